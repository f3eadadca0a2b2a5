// See frame_log.hpp.
#include "sdk/session/frame_log.hpp"

#include <algorithm>

namespace defrec::cli {

void FrameLog::add(const FrameRow& row) {
    for (const auto& [name, milliseconds] : row.stage_ms) {
        Stage& runs = stage(name);
        runs.ms.resize(rows_.size() + 1, 0);
        runs.ms.back() += static_cast<float>(milliseconds);
    }
    const auto kept = [this](const std::string& text) { return &*texts_.insert(text).first; };
    const FrameNumbers& numbers = row;
    rows_.push_back({numbers, kept(row.state), kept(row.reasons), kept(row.faulty_views)});
    for (Stage& each : stages_) each.ms.resize(rows_.size(), 0);
}

FrameLog::Stage& FrameLog::stage(const std::string& name) {
    const auto found = std::find_if(stages_.begin(), stages_.end(),
                                    [&](const Stage& each) { return each.name == name; });
    return found != stages_.end() ? *found : stages_.emplace_back(Stage{name, {}});
}

}  // namespace defrec::cli
