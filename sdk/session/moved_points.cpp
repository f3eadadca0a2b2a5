// Points that a job has moved to its frame.
#include "sdk/session/moved_points.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace defrec::cli {

void MovedPoints::resize(std::size_t count) {
    xyz.resize(3 * count);
    expected_error_mm.resize(count);
    covariance.resize(6 * count);
    status.resize(count);
    uv.resize(2 * count);
}

void MovedPoints::project(RawProjection& projection) {
    projection.project(xyz.data(), status.size(), uv.data());
}

bool MovedPoints::fill(std::size_t i, PositionRow& row) const {
    const double* position = &xyz[3 * i];
    if (status[i] == DEFREC_POINT_UNKNOWN ||
        !std::isfinite(position[0] + position[1] + position[2]))
        return false;
    row.status =
        status[i] == DEFREC_POINT_OBSERVED ? PointStatus::kTracked : PointStatus::kExtrapolated;
    std::copy_n(position, 3, row.xyz);
    std::copy_n(&uv[2 * i], 2, row.uv);
    row.expected_error_mm = expected_error_mm[i];
    std::copy_n(&covariance[6 * i], 6, row.covariance);
    return true;
}

double StatusCounts::share(PointStatus status) const {
    const std::size_t total = std::accumulate(std::begin(rows_), std::end(rows_), std::size_t{0});
    return static_cast<double>(rows_[static_cast<std::size_t>(status)]) /
           static_cast<double>(std::max<std::size_t>(1, total));
}

}  // namespace defrec::cli
