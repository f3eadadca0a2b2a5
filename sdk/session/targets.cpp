// targets.csv as input.
#include "sdk/session/targets.hpp"

#include <algorithm>
#include <limits>
#include <string>

#include "sdk/io/csv.hpp"
#include "sdk/io/text.hpp"
#include "sdk/session/decisions.hpp"
#include "sdk/session/points.hpp"

namespace defrec::cli {
namespace {

using decisions::TargetPlaces;

bool is_far_away(const Target& target, const std::vector<std::array<float, 3>>& surface) {
    const std::size_t step = 1 + (surface.size() - 1) / TargetPlaces::kVertices;
    for (std::size_t i = 0; i < surface.size(); i += step) {
        double squared = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double difference = target.xyz[axis] - double{surface[i][axis]};
            squared += difference * difference;
        }
        if (squared <= TargetPlaces::kFarAway * TargetPlaces::kFarAway) return false;
    }
    return true;
}

double longest_side(const std::vector<Target>& targets) {
    double side = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto [low, high] = std::minmax_element(
            targets.begin(), targets.end(),
            [axis](const Target& a, const Target& b) { return a.xyz[axis] < b.xyz[axis]; });
        side = std::max(side, high->xyz[axis] - low->xyz[axis]);
    }
    return side;
}

// A registration moves metres next to where the model's origin is, which may be in the organ.
std::string note_on_one_point(const std::vector<Target>& targets, const std::string& name) {
    const double side = targets.empty() ? 0 : longest_side(targets);
    if (side == 0 || side > TargetPlaces::kOnePoint) return {};
    return "All " + std::to_string(targets.size()) + name + "lie within " + format_fixed(side, 2) +
           " mm of each other: they may be in metres where mm were expected.";
}

const char* remedy_for(TargetsOf source) {
    if (source == TargetsOf::kPlan)
        return ". They may have been in metres, or in another frame than the model, when they were "
               "registered: see the notes of `defrec register`, and make the plan again.";
    return ". They may be in metres, or in the frame of a model that is not registered: give mm in "
           "the left rectified camera of the template's frame, as `defrec register --targets` "
           "finds them.";
}

}  // namespace

std::vector<Target> read_targets(const std::filesystem::path& path) {
    CsvReader csv(path, {"id", "x", "y", "z"}, {"depth"});
    std::vector<Target> targets;
    UniqueIds ids;
    while (csv.next()) {
        if (targets.size() == kMaxTargets) {
            csv.fail("the file has more than " + std::to_string(kMaxTargets) +
                     " targets, which is the most that are followed.");
        }
        Target target{csv.integer(0), {csv.number(1), csv.number(2), csv.number(3)}};
        if (!csv.is_empty(4)) target.depth = csv.number(4);
        ids.add(csv, target.id);
        if (target.xyz[2] <= 0) {
            csv.fail("z is " + format_fixed(target.xyz[2], 2) +
                     "; more than 0 was expected, in front of the camera. Places of a model have "
                     "to be registered first: see `defrec register`.");
        }
        targets.push_back(target);
    }
    if (targets.empty()) csv.fail("the file names no target.");
    return targets;
}

TargetPlacesNote note_on_places(const std::vector<Target>& targets,
                                const std::vector<std::array<float, 3>>& surface,
                                TargetsOf source) {
    if (surface.empty()) return {};
    double nearest = std::numeric_limits<double>::infinity();
    for (const std::array<float, 3>& vertex : surface)
        nearest = std::min(nearest, double{vertex[2]});
    std::vector<std::int64_t> in_front, far_away;
    for (const Target& target : targets) {
        if (target.xyz[2] < nearest - TargetPlaces::kInFront)
            in_front.push_back(target.id);
        else if (is_far_away(target, surface))
            far_away.push_back(target.id);
    }
    const std::string name = source == TargetsOf::kPlan ? " targets of the plan " : " targets ";
    if (in_front.empty() && far_away.empty()) {
        std::string text = note_on_one_point(targets, name);
        const bool is_doubtful = !text.empty();
        return {std::move(text), is_doubtful};
    }
    std::string text;
    const auto add = [&](const std::vector<std::int64_t>& ids, double mm, const char* where) {
        if (ids.empty()) return;
        text += (text.empty() ? "" : ", ") + std::to_string(ids.size()) + " of " +
                std::to_string(targets.size()) + name + "lie more than " + format_fixed(mm, 0) +
                " mm " + where + " (" + first_ids(ids) + ")";
    };
    add(in_front, TargetPlaces::kInFront, "in front of the whole surface");
    add(far_away, TargetPlaces::kFarAway, "away from the surface");
    const bool is_most = 2 * (in_front.size() + far_away.size()) > targets.size();
    text += is_most ? remedy_for(source) : ": no tissue that is followed is there.";
    return {std::move(text), is_most};
}

}  // namespace defrec::cli
