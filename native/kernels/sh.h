// Real spherical harmonics of degree 0 to 3 in the order and sign of 3DGS, for whole lanes.
#pragma once
#include "lanes.h"

namespace dd::DD_ISA {

constexpr float kSh0 = 0.28209479177387814f, kSh1 = 0.4886025119029199f;
constexpr float kSh2[5] = {1.0925484305920792f, -1.0925484305920792f, 0.31539156525252005f, -1.0925484305920792f,
                           0.5462742152960396f};
constexpr float kSh3[7] = {-0.5900435899266435f, 2.890611442640554f,  -0.4570457994644658f, 0.3731763325901154f,
                           -0.4570457994644658f, 1.445305721320277f, -0.5900435899266435f};

// Basis functions (1, 4, 9 or 16) at the unit direction (x, y, z).
static inline void sh_basis(int degree, V x, V y, V z, V* basis) {
  basis[0] = broadcast(kSh0);
  if (degree < 1) return;
  basis[1] = -kSh1 * y;
  basis[2] = kSh1 * z;
  basis[3] = -kSh1 * x;
  if (degree < 2) return;
  const V xx = x * x, yy = y * y, zz = z * z;
  basis[4] = kSh2[0] * x * y;
  basis[5] = kSh2[1] * y * z;
  basis[6] = kSh2[2] * (2.0f * zz - xx - yy);
  basis[7] = kSh2[3] * x * z;
  basis[8] = kSh2[4] * (xx - yy);
  if (degree < 3) return;
  basis[9] = kSh3[0] * y * (3.0f * xx - yy);
  basis[10] = kSh3[1] * x * y * z;
  basis[11] = kSh3[2] * y * (4.0f * zz - xx - yy);
  basis[12] = kSh3[3] * z * (2.0f * zz - 3.0f * xx - 3.0f * yy);
  basis[13] = kSh3[4] * x * (4.0f * zz - xx - yy);
  basis[14] = kSh3[5] * z * (xx - yy);
  basis[15] = kSh3[6] * x * (xx - 3.0f * yy);
}

// Gradient of sum_k weight[k] basis[k](x, y, z) by x, y, z, the three taken as free.
static inline void sh_gradient(int degree, V x, V y, V z, const V* weight, V out[3]) {
  V gx = V{}, gy = V{}, gz = V{};
  if (degree >= 1) {
    gx -= kSh1 * weight[3];
    gy -= kSh1 * weight[1];
    gz += kSh1 * weight[2];
  }
  if (degree >= 2) {
    const V w4 = kSh2[0] * weight[4], w5 = kSh2[1] * weight[5], w6 = kSh2[2] * weight[6];
    const V w7 = kSh2[3] * weight[7], w8 = kSh2[4] * weight[8];
    gx += y * w4 - 2.0f * x * w6 + z * w7 + 2.0f * x * w8;
    gy += x * w4 + z * w5 - 2.0f * y * w6 - 2.0f * y * w8;
    gz += y * w5 + 4.0f * z * w6 + x * w7;
  }
  if (degree >= 3) {
    const V xx = x * x, yy = y * y, zz = z * z, xy = x * y, xz = x * z, yz = y * z;
    const V w9 = kSh3[0] * weight[9], w10 = kSh3[1] * weight[10], w11 = kSh3[2] * weight[11];
    const V w12 = kSh3[3] * weight[12], w13 = kSh3[4] * weight[13], w14 = kSh3[5] * weight[14];
    const V w15 = kSh3[6] * weight[15];
    gx += 6.0f * xy * w9 + yz * w10 - 2.0f * xy * w11 - 6.0f * xz * w12 + (4.0f * zz - 3.0f * xx - yy) * w13 +
          2.0f * xz * w14 + 3.0f * (xx - yy) * w15;
    gy += 3.0f * (xx - yy) * w9 + xz * w10 + (4.0f * zz - xx - 3.0f * yy) * w11 - 6.0f * yz * w12 - 2.0f * xy * w13 -
          2.0f * yz * w14 - 6.0f * xy * w15;
    gz += xy * w10 + 8.0f * yz * w11 + (6.0f * zz - 3.0f * xx - 3.0f * yy) * w12 + 8.0f * xz * w13 + (xx - yy) * w14;
  }
  out[0] = gx;
  out[1] = gy;
  out[2] = gz;
}

}  // namespace dd::DD_ISA
