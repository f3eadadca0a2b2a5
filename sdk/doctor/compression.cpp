// Whether compression shows, and what it costs.
#include "sdk/doctor/findings.hpp"
#include "sdk/doctor/sentence.hpp"
#include "sdk/input/compression/decisions.hpp"

namespace defrec::cli {
namespace {

// A calibration that does not fit the views costs depth as well, and so does a view that is late;
// images without matches do not tell.
bool costs_all_depth(const Evidence& evidence) {
    const bool may_fit = evidence.probe.has_rig && (!evidence.has_trials() || evidence.has_depth());
    const auto is_found = [&](Finding (*look)(const Evidence&)) {
        return look(evidence).verdict == Verdict::kFound;
    };
    return may_fit &&
           evidence.probe.share_without_depth() >= decisions::CompressedVideo::kMostWithoutDepth &&
           !is_found(look_at_rows) && !is_found(look_at_lag);
}

}  // namespace

Finding look_at_compression(const Evidence& evidence) {
    const CompressionSigns& signs = evidence.compression;
    const bool is_of_no_use = signs.are_strong() && costs_all_depth(evidence);
    Look look("compression", "compression", is_of_no_use ? Severity::kError : Severity::kWarning);
    if (signs.has_copies() && !signs.has_borders())
        look.measured(100 * *signs.copied, "%");
    else
        look.measured(signs.border_ratio, "");
    if (!signs.are_strong())
        return look.fine(signs.copied
                             ? "no blocks stand out, by their borders or as copies"
                             : "no blocks stand out by their borders; too little texture tells of "
                               "copies");
    const std::string what =
        is_of_no_use ? "the video is compressed beyond use, there is no depth in " +
                           percent(evidence.probe.share_without_depth()) + " of the surface: "
                     : "the video is strongly compressed: ";
    return look.found(what + signs.seen() + ".", kCompressionRemedy);
}

}  // namespace defrec::cli
