// See tissue_changes.hpp.
#include "sdk/tracking/monitors/tissue_changes.hpp"

#include <exception>

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
        cuts_.add_frame(data, output.samples, is_confirmed);
        departed_.add_frame(data, output, is_confirmed);
        slips_.add_frame(data, output, is_confirmed,
                         slips_.wants_image() ? image_ : std::span<const uint8_t>(), helpers);
    } catch (const std::exception&) {
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
