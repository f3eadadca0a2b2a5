// See prepared_targets.hpp.
#include "sdk/tracking/points/prepared_targets.hpp"

#include "sdk/base/util/error.hpp"
#include "sdk/body/body_slot.hpp"

namespace defrec {
namespace {

std::vector<double> checked_copy(const double* xyz, size_t count) {
    if (count > PreparedTargets::kMaxTargets)
        fail(DEFREC_ERROR_ARGUMENT, "count is ", count, ", at most ", PreparedTargets::kMaxTargets,
             " targets are possible");
    return {xyz, xyz + 3 * count};
}

}  // namespace

PreparedTargets::PreparedTargets(std::shared_ptr<const Template> surface,
                                 const double* template_xyz, size_t count)
    : surface_(std::move(surface)), xyz_(checked_copy(template_xyz, count)) {}

std::shared_ptr<const PreparedSet> PreparedTargets::prepared(
    const std::shared_ptr<const Template>& surface, const Services* helpers) const {
    std::shared_ptr<const Body> body = surface->body().body();
    const std::lock_guard lock(mutex_);
    if (last_ != nullptr && last_->surface == surface && last_->body == body) return last_;
    last_ = prepare_set(surface, std::move(body), xyz_.data(), count(), helpers);
    return last_;
}

}  // namespace defrec
