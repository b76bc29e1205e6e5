// Gaussians at a time: on their actors' tracks, with what the network adds, faded by their life spans; and back.
#pragma once
#include <cstdint>

namespace dd {

struct PoseTask {
  int64_t n;
  const float *means, *quaternions, *log_scales, *logits;  // canonical: (n, 3), (n, 4), (n, 3), (n)
  const float* residual;                                   // (n, 10), to mean, unit quaternion and log-scale
  const float* lifespan;                                   // (n, 2): centre and deviation in seconds, or null
  const int64_t* actor;                                    // (n), -1 for none, or null
  const float *translation, *yaw, *pivot;                  // of the actors: (a, 3), (a), (a, 3)
  int64_t actors;
  float up[3], time_s;
};
struct Posed {
  float *means, *quaternions, *log_scales, *logits;
};
struct PosedGradient {
  const float *means, *quaternions, *log_scales, *logits;
};
struct PoseGradient {
  float *means, *quaternions, *logits, *residual, *translation, *yaw;
};
void pose_forward(const PoseTask& task, const Posed& out);
// The gradient of log_scales is the upstream one.
void pose_backward(const PoseTask& task, const PosedGradient& upstream, const PoseGradient& out);

}  // namespace dd
