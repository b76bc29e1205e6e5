// EWA projection of 3D Gaussians (Zwicker et al. 2001, as in 3DGS), for whole lanes: shared by forward and backward.
#pragma once
#include "lanes.h"
#include "types.h"

namespace dd::DD_ISA {

struct V3 {
  V x = V{}, y = V{}, z = V{};
};
static inline V dot(V3 a, V3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline V3 cross(V3 a, V3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static inline V3 scaled(V3 a, V s) { return {a.x * s, a.y * s, a.z * s}; }

// Everything between a Gaussian's parameters and its conic that the backward pass needs again.
struct Projection {
  V3 camera;                  // centre in the camera frame
  V inverse_z, tx, ty;        // 1/z; x/z and y/z after the clamp
  V inverse_norm;             // of the quaternion
  V qw, qx, qy, qz;           // unit quaternion
  V3 axis[3];                 // rows of the rotation matrix of the quaternion
  V3 t0, t1;                  // Jacobian times camera rotation, 2 x 3
  V3 m0, m1;                  // the above times rotation times scale; covariance = M M^T + blur
  V cov_xx, cov_xy, cov_yy, inverse_det;
  V3 cross;                   // m0 x m1: its square is the determinant without the blur
};

static inline void unit_quaternion(V w, V x, V y, V z, Projection& p) {
  p.inverse_norm = 1.0f / vmax(vsqrt(w * w + x * x + y * y + z * z), broadcast(1e-12f));
  p.qw = w * p.inverse_norm;
  p.qx = x * p.inverse_norm;
  p.qy = y * p.inverse_norm;
  p.qz = z * p.inverse_norm;
  const V xx = p.qx * p.qx, yy = p.qy * p.qy, zz = p.qz * p.qz, xy = p.qx * p.qy, xz = p.qx * p.qz;
  const V yz = p.qy * p.qz, wx = p.qw * p.qx, wy = p.qw * p.qy, wz = p.qw * p.qz;
  p.axis[0] = {1.0f - 2.0f * (yy + zz), 2.0f * (xy - wz), 2.0f * (xz + wy)};
  p.axis[1] = {2.0f * (xy + wz), 1.0f - 2.0f * (xx + zz), 2.0f * (yz - wx)};
  p.axis[2] = {2.0f * (xz - wy), 2.0f * (yz + wx), 1.0f - 2.0f * (xx + yy)};
}

static inline V3 to_camera(const View& view, V3 mean) {
  const float *r = view.rotation, *t = view.translation;
  return {r[0] * mean.x + r[1] * mean.y + r[2] * mean.z + t[0], r[3] * mean.x + r[4] * mean.y + r[5] * mean.z + t[1],
          r[6] * mean.x + r[7] * mean.y + r[8] * mean.z + t[2]};
}

// Row of (Jacobian x camera rotation) x rotation x scale.
static inline V3 footprint_row(V3 t, const V3 axis[3], V3 scale) {
  return {(t.x * axis[0].x + t.y * axis[1].x + t.z * axis[2].x) * scale.x,
          (t.x * axis[0].y + t.y * axis[1].y + t.z * axis[2].y) * scale.y,
          (t.x * axis[0].z + t.y * axis[1].z + t.z * axis[2].z) * scale.z};
}

// Fills everything but the quaternion part; lanes nearer than the near plane are computed at z = 1 and must be dropped.
static inline void project_lanes(const View& view, V3 mean, V3 scale, Projection& p) {
  p.camera = to_camera(view, mean);
  p.inverse_z = 1.0f / (p.camera.z >= kNear ? p.camera.z : broadcast(1.0f));
  p.tx = vmin(vmax(p.camera.x * p.inverse_z, broadcast(view.min_tx)), broadcast(view.max_tx));
  p.ty = vmin(vmax(p.camera.y * p.inverse_z, broadcast(view.min_ty)), broadcast(view.max_ty));
  const float* r = view.rotation;
  const V sx = view.fx * p.inverse_z, sy = view.fy * p.inverse_z;
  p.t0 = {sx * (r[0] - p.tx * r[6]), sx * (r[1] - p.tx * r[7]), sx * (r[2] - p.tx * r[8])};
  p.t1 = {sy * (r[3] - p.ty * r[6]), sy * (r[4] - p.ty * r[7]), sy * (r[5] - p.ty * r[8])};
  p.m0 = footprint_row(p.t0, p.axis, scale);
  p.m1 = footprint_row(p.t1, p.axis, scale);
  const V n0 = dot(p.m0, p.m0), n1 = dot(p.m1, p.m1);
  p.cov_xx = n0 + kBlur;
  p.cov_yy = n1 + kBlur;
  p.cov_xy = dot(p.m0, p.m1);
  // det(M M^T + blur) from |m0 x m1|^2: cov_xx cov_yy - cov_xy^2 would cancel for long thin Gaussians.
  p.cross = cross(p.m0, p.m1);
  p.inverse_det = 1.0f / (dot(p.cross, p.cross) + kBlur * (n0 + n1) + kBlur * kBlur);
}

// Row `k` of L Gaussians from an array of rows of `stride` floats.
static inline V gather(const float* rows, int stride, const uint32_t* index, int k) {
  V v;
  for (int l = 0; l < kLanes; l++) v[l] = rows[int64_t(index[l]) * stride + k];
  return v;
}
static inline V3 gather3(const float* rows, int stride, const uint32_t* index, int k = 0) {
  return {gather(rows, stride, index, k), gather(rows, stride, index, k + 1), gather(rows, stride, index, k + 2)};
}

}  // namespace dd::DD_ISA
