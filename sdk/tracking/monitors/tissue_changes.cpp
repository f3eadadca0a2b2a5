// See tissue_changes.hpp.
#include "sdk/tracking/monitors/tissue_changes.hpp"

#include <new>

#include "sdk/base/os/helped_loop.hpp"

namespace defrec {

void TissueChanges::reset() {
    cuts_.reset();
    slips_.reset();
    departed_.reset();
}

void TissueChanges::add_frame(const TemplateData& data, const FrameOutput& output,
                              std::span<const uint8_t> is_confirmed,
                              const Services* helpers) noexcept {
    try {
        helped_loop(helpers, 3, [&](size_t monitor) {
            if (monitor == 0)
                slips_.add_frame(data, output, is_confirmed,
                                 slips_.wants_image() ? image_ : std::span<const uint8_t>());
            else if (monitor == 1)
                departed_.add_frame(data, output, is_confirmed);
            else
                cuts_.add_frame(data, output.samples, is_confirmed);
        });
    } catch (const std::bad_alloc&) {
        cuts_.reset();  // gaps and slips still show in later frames; that tissue left does not
        slips_.reset();
    }
}

Slip TissueChanges::take_line() {
    Slip line = slips_.found() ? *slips_.found() : Slip{*cuts_.found(), {}};
    cuts_.reset();
    slips_.reset();
    return line;
}

}  // namespace defrec
