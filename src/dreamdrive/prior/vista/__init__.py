"""Video models as priors: Stable Video Diffusion and Vista, one network on diffusers' classes."""
