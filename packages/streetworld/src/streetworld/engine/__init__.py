"""The engine that editions share: meshes, materials, rays, and a street to look at."""
