// See doubtful_frames.hpp.
#include "sdk/report/doubtful_frames.hpp"

#include <algorithm>

#include "sdk/report/reason_words.hpp"

namespace defrec::cli {
namespace {

constexpr int kFollowed = 3;

int order_of(std::string_view state) {
    return state == "lost" ? 0 : state == "initialising" ? 1 : state == "degraded" ? 2 : kFollowed;
}

// They are set in frames as well that are tracked well: another reason explains more.
bool is_mild(std::string_view reason) {
    return reason == "few-matches" || reason == "gap" || reason == "fast-motion";
}

std::string_view main_reason(std::string_view state, std::string_view reasons) {
    const std::vector<std::string_view> names = reason_names(reasons);
    const auto has_remedy = [&](std::string_view name) { return !remedy_of(name, state).empty(); };
    const auto strong = std::find_if(names.begin(), names.end(), [&](std::string_view name) {
        return has_remedy(name) && !is_mild(name);
    });
    if (strong != names.end() || state == "initialising")
        return strong == names.end() ? std::string_view() : *strong;
    const auto any = state == "lost" ? std::find_if(names.begin(), names.end(), has_remedy)
                                     : std::find_if(names.begin(), names.end(), words_of);
    return any == names.end() ? std::string_view() : *any;
}

// Which picture a reason speaks of. The left one alone is enough to follow tissue, the right one is
// not.
std::string_view picture_of(std::string_view reason, std::string_view state,
                            std::string_view reasons) {
    const std::vector<std::string_view> names = reason_names(reasons);
    const auto has = [&](std::string_view name) {
        return std::find(names.begin(), names.end(), name) != names.end();
    };
    if (has("one-view")) return state == "degraded" ? "the right picture" : std::string_view();
    return reason == "dark" && !has("saturated") ? "both pictures" : std::string_view();
}

std::string words_about(const ReasonWords& reason, std::string_view picture) {
    if (!picture.empty()) {
        const std::string verb = picture == "both pictures" ? " are " : " is ";
        if (reason.name == "dark") return std::string(picture) + verb + "black";
        if (reason.name == "saturated") return std::string(picture) + verb + "white";
        if (reason.name == "one-view") return std::string(picture) + verb + "missing";
    }
    return std::string(reason.words);
}

}  // namespace

std::string DoubtfulFrames::where() const {
    if (first == last) return "frame " + std::to_string(first);
    const std::string ends = std::to_string(first) + " to " + std::to_string(last);
    return count == span ? "frames " + ends : std::to_string(count) + " of the frames " + ends;
}

std::string DoubtfulFrames::why() const {
    const ReasonWords* words = words_of(reason);
    if (words == nullptr && state == "lost") words = words_of("few-matches");
    if (words == nullptr) return "less is observed than usual";
    std::string text = words_about(*words, picture);
    const std::string_view remedy = remedy_of(words->name, state);
    if (!remedy.empty()) text.append("; ").append(remedy);
    return text;
}

void DoubtfulFramesList::add(std::int64_t frame, std::string_view state, std::string_view reasons) {
    const std::int64_t at = frames_++;
    if (order_of(state) == kFollowed) return;
    const std::string_view reason = main_reason(state, reasons);
    if (state == "initialising" && reason.empty()) return;  // as frames before a template are
    const std::string_view picture = picture_of(reason, state, reasons);
    auto item = std::find_if(items_.begin(), items_.end(), [&](const Item& each) {
        return each.frames.state == state && each.frames.reason == reason &&
               each.frames.picture == picture;
    });
    if (item == items_.end()) {
        items_.push_back(
            {{std::string(state), std::string(reason), std::string(picture), frame}, at});
        item = items_.end() - 1;
    }
    item->frames.last = frame;
    ++item->frames.count;
    item->frames.span = at - item->first_at + 1;
}

std::vector<DoubtfulFrames> DoubtfulFramesList::sorted() const {
    std::vector<DoubtfulFrames> result;
    for (const Item& item : items_) result.push_back(item.frames);
    std::stable_sort(result.begin(), result.end(),
                     [](const DoubtfulFrames& a, const DoubtfulFrames& b) {
                         if (a.state != b.state) return order_of(a.state) < order_of(b.state);
                         return a.count > b.count;
                     });
    return result;
}

}  // namespace defrec::cli
