// Whether splatting can use what it was given: NaN and overflow would spread to pixels that a Gaussian does not touch.
#pragma once
#include "kernels/types.h"

namespace dd {

// Every number finite and at most 1e30 in magnitude, scales not negative, opacities in [0, 1], quaternions neither so
// short nor so long that float32 cannot normalise them.
bool all_usable(const Inputs& in);

}  // namespace dd
