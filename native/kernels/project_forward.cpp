// Projection of Gaussians to splats: geometry for all, colour for those that can be seen.
#include "ewa.h"
#include "kernel_list.h"
#include "sh.h"

namespace dd::DD_ISA {
namespace {

// Geometry of kLanes Gaussians; returns the mask of those that can reach a pixel centre.
I geometry(const Inputs& in, const View& view, const uint32_t* index, Splat* out) {
  Projection p;
  unit_quaternion(gather(in.quaternions, 4, index, 0), gather(in.quaternions, 4, index, 1),
                  gather(in.quaternions, 4, index, 2), gather(in.quaternions, 4, index, 3), p);
  project_lanes(view, gather3(in.means, 3, index), gather3(in.scales, 3, index), p);
  V u = view.fx * p.camera.x * p.inverse_z + view.cx, v = view.fy * p.camera.y * p.inverse_z + view.cy;
  if (in.offsets) {
    u += gather(in.offsets, 2, index, 0);
    v += gather(in.offsets, 2, index, 1);
  }
  V opacity = gather(in.opacities, 1, index, 0);
  if (view.antialiased) opacity *= vsqrt(dot(p.cross, p.cross) * p.inverse_det);
  I seen = (p.camera.z >= kNear) & (p.camera.z <= kFar) & (opacity >= kMinAlpha) & (p.inverse_det > 0.0f);
  if (!any(seen)) return seen;
  const V log2_opacity = vlog2(opacity);
  // The slack covers rounding; the alpha of each pixel decides in the end.
  const V range = vsqrt(vmax((log2_opacity - kMinPower) * (2.0f / kLog2e), V{})) * 1.0001f + 1e-3f;
  const V reach_x = range * vsqrt(p.cov_xx), reach_y = range * vsqrt(p.cov_yy);
  seen &= (u + reach_x >= 0.5f) & (u - reach_x <= float(view.width) - 0.5f) & (v + reach_y >= 0.5f) &
          (v - reach_y <= float(view.height) - 0.5f);
  const V conic_xx = p.cov_yy * p.inverse_det, conic_xy = -p.cov_xy * p.inverse_det;
  const V along = (-0.5f * kLog2e) / conic_xx, across = (-0.5f * kLog2e) / p.cov_yy;
  const V slope_x = p.cov_xy / p.cov_yy, half_width = range * vsqrt(1.0f / conic_xx);
  seen &= (conic_xx > 0.0f) & (reach_x < 1e9f) & (reach_y < 1e9f);  // false for what overflowed
  for (int l = 0; l < kLanes; l++)
    if (seen[l])
      out[index[l]] = {u[l],       v[l],       conic_xx[l], conic_xy[l], along[l],  across[l],     log2_opacity[l],
                       reach_x[l], reach_y[l], slope_x[l],  half_width[l], {0, 0, 0}, p.camera.z[l], index[l]};
  return seen;
}

void colours(const Inputs& in, const View& view, const uint32_t* index, int count, Splat* out) {
  const V3 mean = gather3(in.means, 3, index);
  V3 direction = {mean.x - view.eye[0], mean.y - view.eye[1], mean.z - view.eye[2]};
  direction = scaled(direction, 1.0f / vmax(vsqrt(dot(direction, direction)), broadcast(1e-12f)));
  V basis[16];
  sh_basis(in.sh_degree, direction.x, direction.y, direction.z, basis);
  const int used = (in.sh_degree + 1) * (in.sh_degree + 1);
  for (int ch = 0; ch < 3; ch++) {
    V colour = broadcast(0.5f);
    for (int k = 0; k < used; k++) colour += basis[k] * gather(in.sh, 3 * in.sh_stored, index, 3 * k + ch);
    colour = vmax(colour, V{});
    for (int l = 0; l < count; l++) out[index[l]].colour[ch] = colour[l];
  }
}

}  // namespace

int project(const Inputs& in, const View& view, int64_t first, int64_t last, Splat* projected, uint64_t* keys) {
  uint32_t list[kChunk + kLanes], index[kLanes];
  int n = 0;
  for (int64_t base = first; base < last; base += kLanes) {
    for (int l = 0; l < kLanes; l++) index[l] = uint32_t(base + l < last ? base + l : last - 1);
    const I seen = geometry(in, view, index, projected);
    for (int l = 0; l < kLanes && base + l < last; l++)
      if (seen[l]) list[n++] = index[l];
  }
  for (int l = 0; l < kLanes && n; l++) list[n + l] = list[n - 1];
  for (int i = 0; i < n; i += kLanes) colours(in, view, list + i, n - i < kLanes ? n - i : kLanes, projected);
  for (int i = 0; i < n; i++) {
    uint32_t bits;  // of a positive float: ordered like the depth itself
    __builtin_memcpy(&bits, &projected[list[i]].depth, 4);
    keys[i] = uint64_t(bits) << 32 | list[i];
  }
  return n;
}

}  // namespace dd::DD_ISA
