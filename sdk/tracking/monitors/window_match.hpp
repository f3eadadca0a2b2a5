// How well the live image shows a window of the template's first view where a motion has it.
#pragma once
#include <cstdint>
#include <optional>
#include <span>

#include "backends/shared/motion.hpp"
#include "sdk/template/surface_point.hpp"
#include "sdk/template/template.hpp"

namespace defrec {

class WindowMatch {
  public:
    // image: the rectified left one, of the template's size.
    WindowMatch(const TemplateData& data, std::span<const uint8_t> image)
        : data_(data), image_(image) {}

    // Half steps between samples, in the live image.
    struct Shift {
        int x = 0, y = 0;
    };
    // The largest ZNCC of a window round the place within decisions::Slips::kSearchRadius of where
    // the motion and the shift have it, 0 where it is flat; nothing where a window leaves its
    // image. Where it is at least kMinZncc the shift becomes the one that was found.
    std::optional<double> zncc(const SurfacePlace& place, const DualQuaternion<double>& motion,
                               Shift& shift) const;

  private:
    const TemplateData& data_;
    std::span<const uint8_t> image_;
};

}  // namespace defrec
