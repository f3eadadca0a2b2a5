// See doubtful_frames.hpp.
#include "sdk/report/doubtful_frames.hpp"

#include <algorithm>
#include <utility>

#include "sdk/report/reason_words.hpp"

namespace defrec::cli {
namespace {

constexpr int kFollowed = 3;

bool is_lost(std::string_view state) { return state == "lost" || state == "unfound"; }

int order_of(std::string_view state) {
    return is_lost(state) ? 0 : state == "initialising" ? 1 : state == "degraded" ? 2 : kFollowed;
}

// They are set in frames as well that are tracked well: another reason explains more.
bool is_mild(std::string_view reason) {
    return reason == "few-matches" || reason == "gap" || reason == "fast-motion";
}

// The reason that explains a frame's state; null: none does.
const ToldReason* main_reason(std::string_view state, const std::vector<ToldReason>& reasons) {
    const auto first = [&](auto&& is_so) {
        const auto found = std::find_if(reasons.begin(), reasons.end(), is_so);
        return found == reasons.end() ? nullptr : &*found;
    };
    const auto helps = [&](const ToldReason& reason) { return !remedy_of(reason, state).empty(); };
    const ToldReason* strong =
        first([&](const ToldReason& reason) { return helps(reason) && !is_mild(reason.name); });
    if (strong != nullptr || state == "initialising") return strong;
    if (is_lost(state)) return first(helps);
    return first([](const ToldReason& reason) { return words_of(reason.name) != nullptr; });
}

std::string why(std::string_view state, const ToldReason* reason) {
    const std::vector<ToldReason> unrecognised = told_reasons("few-matches", "");
    if (reason == nullptr && is_lost(state)) reason = &unrecognised.front();
    if (reason == nullptr) return "less is observed than usual";
    std::string text = reason->words;
    const std::string_view remedy = remedy_of(*reason, state);
    if (!remedy.empty()) text.append("; ").append(remedy);
    return text;
}

}  // namespace

std::string DoubtfulFrames::where() const {
    if (first == last) return "frame " + std::to_string(first);
    const std::string ends = std::to_string(first) + " to " + std::to_string(last);
    return count == span ? "frames " + ends : std::to_string(count) + " of the frames " + ends;
}

void DoubtfulFramesList::add(std::int64_t frame, std::string_view state, std::string_view reasons,
                             std::string_view faulty_views) {
    const std::int64_t at = frames_++;
    if (order_of(state) == kFollowed) return;
    const std::vector<ToldReason> told = told_reasons(reasons, faulty_views);
    const ToldReason* reason = main_reason(state, told);
    if (state == "initialising" && reason == nullptr) return;  // as frames before a template are
    const std::string_view name = reason == nullptr ? std::string_view() : reason->name;
    std::string text = why(state, reason);
    if (is_lost(state)) state = "lost";
    auto item = std::find_if(items_.begin(), items_.end(), [&](const Item& each) {
        return each.frames.state == state && each.frames.reason == name && each.frames.why == text;
    });
    if (item == items_.end()) {
        items_.push_back({{std::string(state), std::string(name), std::move(text), frame}, at});
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
