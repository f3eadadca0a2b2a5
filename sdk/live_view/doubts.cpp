// See doubts.hpp.
#include "sdk/live_view/doubts.hpp"

#include <algorithm>

#include "sdk/base/util/error.hpp"
#include "sdk/report/shown_state.hpp"

namespace defrec::cli {
namespace {

void add_name(std::string name, ViewDoubts::Named& named) {
    if (named.names.size() < ViewDoubts::kMostNames) named.names.push_back(std::move(name));
    ++named.count;
}

// The largest errors first.
void add_errors(std::vector<std::pair<double, std::string>> errors, ViewDoubts::Named& named) {
    std::stable_sort(errors.begin(), errors.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    for (auto& [error, name] : errors) {
        if (named.names.size() < ViewDoubts::kMostNames) named.errors_mm.push_back(error);
        add_name(std::move(name), named);
    }
}

}  // namespace

ViewDoubts doubts_of(const std::vector<ViewPoint>& points,
                     const std::vector<TargetEstimate>& targets,
                     const std::set<std::int64_t>& placed) {
    ViewDoubts doubts;
    std::vector<std::pair<double, std::string>> errors, target_errors;
    for (const ViewPoint& point : points) {
        if (!point.is_chosen) continue;
        std::string name = point.name.empty() ? concat("#", point.id) : point.name;
        if (point.status == VertexStatus::unknown)
            add_name(std::move(name), placed.count(point.id) > 0 ? doubts.lost : doubts.never);
        else if (ShownState::is_too_large(point.expected_error_mm))
            errors.emplace_back(point.expected_error_mm, std::move(name));
    }
    for (const TargetEstimate& target : targets) {
        const auto error = static_cast<double>(expected_error(target));
        if (target.status == VertexStatus::unknown || !ShownState::is_too_large(error)) continue;
        target_errors.emplace_back(
            error, target.name.empty() ? concat("target ", target.id) : target.name);
    }
    add_errors(std::move(errors), doubts.large);
    add_errors(std::move(target_errors), doubts.targets);
    return doubts;
}

ViewDoubts doubts_that_stay(ViewDoubts doubts, std::vector<ViewPoint> given,
                            const std::vector<ViewPoint>& points,
                            const std::set<std::int64_t>& placed) {
    std::set<std::int64_t> ids;
    for (const ViewPoint& point : points) ids.insert(point.id);
    if (std::erase_if(given, [&](const auto& point) { return ids.count(point.id) == 0; }) == 0)
        return doubts;
    const auto count = [](const ViewDoubts& of) {
        return of.large.count + of.lost.count + of.never.count;
    };
    ViewDoubts rest = doubts_of(given, {}, placed);
    rest.targets = std::move(doubts.targets);
    rest.removed = count(doubts) - std::min(count(doubts), count(rest));
    return rest;
}

}  // namespace defrec::cli
