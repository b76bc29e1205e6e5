// Minimum cuts of pictures.
#pragma once
#include <cstdint>

namespace dd {

// The two labels of all pixels (h, w) that cost least: a labelled pixel earns its gain, unlike neighbours cost the weight
// between them, to the right (h, w - 1) or below (h - 1, w). Of equally good ones it is that of the fewest labelled pixels.
void minimum_cut(int height, int width, const int32_t* gain, const int32_t* right, const int32_t* below, uint8_t* labelled);

}  // namespace dd
