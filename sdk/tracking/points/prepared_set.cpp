// See prepared_set.hpp.
#include "sdk/tracking/points/prepared_set.hpp"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <utility>

#include "sdk/base/os/helped_loop.hpp"
#include "sdk/body/body_slot.hpp"

namespace defrec {
namespace {

bool are_same_bits(const double* a, const double* b, size_t count, const Services* helpers) {
    constexpr size_t kRun = 16'384;
    std::atomic<bool> is_same = true;
    helped_runs(count > kRun ? helpers : nullptr, count, kRun, [&](size_t begin, size_t end) {
        if (is_same && std::memcmp(a + begin, b + begin, (end - begin) * sizeof(double)) != 0)
            is_same = false;
    });
    return is_same;
}

}  // namespace

std::shared_ptr<const PreparedSet> prepare_set(std::shared_ptr<const Template> surface,
                                               std::shared_ptr<const Body> body, const double* xyz,
                                               size_t count, const Services* helpers) {
    auto set = std::make_shared<PreparedSet>();
    set->surface = std::move(surface);
    set->body = std::move(body);
    set->points.resize(count);
    set->deep.resize(prepare_points(*set->surface, xyz, helpers, set->points));
    prepare_deep_points(*set->surface, set->body.get(), helpers, set->points, set->deep);
    return set;
}

std::shared_ptr<const PreparedSet> PreparedSets::find_or_prepare(
    const std::shared_ptr<const Template>& surface, const double* xyz, size_t count,
    const Services* helpers) {
    std::shared_ptr<const Body> body = surface->body().body();
    std::vector<Entry> candidates;
    {
        const std::lock_guard lock(mutex_);
        // Nothing is of use any more that is of a template that grew, or a body that was replaced.
        std::erase_if(entries_, [&](const Entry& entry) {
            return entry.set->surface != surface || entry.set->body != body;
        });
        for (const Entry& entry : entries_)
            if (entry.set->points.size() == count) candidates.push_back(entry);
    }
    const auto found =
        std::find_if(candidates.begin(), candidates.end(), [&](const Entry& candidate) {
            return are_same_bits(candidate.xyz->data(), xyz, 3 * count, helpers);
        });
    Entry used;
    if (found != candidates.end())
        used = std::move(*found);
    else
        used = {std::make_shared<const std::vector<double>>(xyz, xyz + 3 * count),
                prepare_set(surface, std::move(body), xyz, count, helpers)};
    const std::lock_guard lock(mutex_);
    std::erase_if(entries_, [&](const Entry& entry) { return entry.set == used.set; });
    entries_.insert(entries_.begin(), used);
    size_t points = 0, kept = 0;
    while (kept < std::min(entries_.size(), kSets) &&
           (points += entries_[kept].set->points.size()) <= kMost)
        ++kept;
    entries_.resize(kept);
    return used.set;
}

}  // namespace defrec
