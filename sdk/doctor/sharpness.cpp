// Whether pixels are smaller than the detail that the images show.
#include <algorithm>
#include <optional>

#include "sdk/doctor/detail.hpp"
#include "sdk/doctor/findings.hpp"

namespace defrec::cli {

Finding look_at_sharpness(const Evidence& evidence) {
    Look look("sharpness", "sharpness", Severity::kWarning);
    std::optional<int> coarsest;
    double least = 1;
    for (const auto view : {&GrayPair::left, &GrayPair::right}) {
        DetailMeter meter;
        for (const GrayPair& pair : evidence.pairs) meter.add(pair.*view);
        const std::optional<int> finest = meter.finest_px();
        if (!finest) continue;
        coarsest = std::max(coarsest.value_or(*finest), *finest);
        least = std::min(least, meter.finest_share());
    }
    if (!coarsest) return look.unknown("the images have too little texture to tell");
    look.measured(100 * least, "%");
    if (*coarsest == 1) return look.fine("the images show detail as fine as their pixels");
    const DetailText text = detail_text(*coarsest);
    return look.found(text.what + ".", text.remedy);
}

}  // namespace defrec::cli
