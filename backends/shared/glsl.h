// What lets a header of constants be read by C++ and by GLSL. Real: of numbers that C++ computes
// with in double precision, shaders in single.
#ifndef DEFREC_SHARED_GLSL
#define DEFREC_SHARED_GLSL
#ifdef __cplusplus
#include <cstdint>
namespace defrec {
using uint = uint32_t;
using Real = double;
}  // namespace defrec
#else
#define constexpr const
#define Real float
#endif
#endif
