// Disparity that an application has measured, in place of stage stereo's: what it may hold, and the
// copy that a frame keeps.
#pragma once
#include <cstdint>
#include <span>
#include <string>

namespace defrec {

class Rig;          // rig.hpp
struct FrameImage;  // frame_input.hpp

// As the application has it, of the rectified left image. values: nullptr: there is none.
struct GivenDisparity {
    const float* values = nullptr;  // px, 0: none there
    const float* sigma = nullptr;   // px, per pixel; nullptr: sigma_px everywhere
    uint64_t stride = 0;            // bytes from row to row
    float sigma_px = 0;             // standard deviation of the error that neighbours share
};

// The first fault that it has; empty: none.
std::string fault_of(const GivenDisparity& given, uint32_t width, uint32_t height);

// As the stages read it, tight rows.
struct KeptDisparity {
    const int16_t* values = nullptr;  // 1/DEFREC_DISPARITY_ONE px or DEFREC_DISPARITY_NONE; null:
                                      // stage stereo measures them
    const float* sigma = nullptr;     // px, 0 where there is no disparity; nullptr: sigma_px
    float sigma_px = 0;               // of all pixels together, RMS
    bool is_empty = false;            // no pixel has some
    bool given() const { return values != nullptr; }
};
// Copies what has no fault, without the pixels that the frame's ignore hides, to values, and to
// sigma where it has a sigma per pixel. ignore: of the raw left image, of the host; may be missing.
KeptDisparity keep_disparity(const GivenDisparity& given, const Rig& rig, const FrameImage& ignore,
                             std::span<int16_t> values, std::span<float> sigma);

}  // namespace defrec
