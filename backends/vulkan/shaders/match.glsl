// What the shaders of stage match share. A descriptor's neighbours are compared by keys, distance
// << 16 | index: the least key is the nearest, then the first.
#include "backends/stages/match.hpp"

const uint kNoKey = 0xffffffffu;
