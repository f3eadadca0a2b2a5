// See display_prediction.hpp.
#include "sdk/session/display_prediction.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "sdk/io/exit_code.hpp"

namespace defrec::cli {
namespace {

constexpr double kNanosecondsPerMs = 1e6;

Predictor make_predictor(std::size_t count) {
    auto desc = initialised<defrec_predictor_desc>();
    desc.point_count = count;
    defrec_predictor handle = nullptr;
    require(defrec_predictor_create(&desc, &handle), ExitCode::kInternal, "making a predictor");
    return Predictor(handle);
}

// An error that has grown is as likely in every direction as it was.
void scale_covariance(double before, double after, double* covariance) {
    const double factor = after * after / (before * before);
    if (std::isfinite(factor))
        std::transform(covariance, covariance + 6, covariance,
                       [&](double value) { return factor * value; });
}

const char* basis_name(std::uint8_t basis) {
    return basis == DEFREC_PREDICTED_LEARNED    ? "learned"
           : basis == DEFREC_PREDICTED_VELOCITY ? "velocity"
                                                : "last";
}

std::vector<std::size_t> in_order(std::size_t count) {
    std::vector<std::size_t> slots(count);
    std::iota(slots.begin(), slots.end(), std::size_t{0});
    return slots;
}

}  // namespace

PointPredictor::PointPredictor(std::size_t count, double delay_ms)
    : delay_ns_(std::llround(delay_ms * kNanosecondsPerMs)), predictor_(make_predictor(count)) {}

void PointPredictor::move(const FrameOutcome& frame, MovedPoints& points,
                          std::vector<std::uint8_t>& basis) {
    const std::size_t count = points.status.size();
    auto given = initialised<defrec_predictor_frame>();
    given.timestamp_ns = frame.timestamp_ns;
    given.state = frame.state;
    given.epoch = frame.epoch;
    given.xyz = points.xyz.data();
    given.status = points.status.data();
    given.expected_error_mm = points.expected_error_mm.data();
    given.count = count;
    require(defrec_predictor_add_frame(predictor_.get(), &given), ExitCode::kInternal,
            "following the points' motion");
    before_ = points.expected_error_mm;
    basis.resize(count);
    require(defrec_predictor_predict(predictor_.get(), frame.timestamp_ns + delay_ns_, count,
                                     points.xyz.data(), points.status.data(),
                                     points.expected_error_mm.data(), basis.data()),
            ExitCode::kInternal, "predicting the points");
    for (std::size_t i = 0; i < count; ++i)
        scale_covariance(before_[i], points.expected_error_mm[i], &points.covariance[6 * i]);
}

std::vector<std::uint8_t> RowPredictor::move(const FrameOutcome& frame,
                                             const std::vector<PositionRow*>& rows,
                                             const std::vector<std::size_t>& slots) {
    std::size_t needed = points_.status.size();
    for (const std::size_t slot : slots) needed = std::max(needed, slot + 1);
    if (needed == 0) return {};
    if (needed > points_.status.size()) {
        // Room for as many more, so that a click now and then seldom forgets anything.
        points_.resize(points_.status.empty() ? needed : 2 * needed);
        predictor_ = std::make_unique<PointPredictor>(points_.status.size(), delay_ms_);
    }
    std::fill(points_.status.begin(), points_.status.end(), std::uint8_t{DEFREC_POINT_UNKNOWN});
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const PositionRow& row = *rows[i];
        if (row.status == PointStatus::kLost) continue;
        const std::size_t slot = slots[i];
        points_.status[slot] =
            row.status == PointStatus::kTracked ? DEFREC_POINT_OBSERVED : DEFREC_POINT_EXTRAPOLATED;
        std::copy_n(row.xyz, 3, &points_.xyz[3 * slot]);
        std::copy_n(row.covariance, 6, &points_.covariance[6 * slot]);
        points_.expected_error_mm[slot] = row.expected_error_mm;
    }
    std::vector<std::uint8_t> all;
    predictor_->move(frame, points_, all);
    points_.project(projection_);
    std::vector<std::uint8_t> basis;
    for (std::size_t i = 0; i < rows.size(); ++i) {
        basis.push_back(all[slots[i]]);
        if (!points_.fill(slots[i], *rows[i])) rows[i]->status = PointStatus::kLost;
    }
    return basis;
}

DisplayPrediction::DisplayPrediction(const std::filesystem::path& path, double delay_ms,
                                     RawProjection& projection)
    : delay_ms_(delay_ms),
      projection_(projection),
      file_(path),
      points_(delay_ms, projection),
      targets_(delay_ms, projection),
      plan_rows_(delay_ms, projection) {}

// finish: fills what a row of the file has beside the position.
template <class Row, class Finish>
void DisplayPrediction::move_rows(const FrameOutcome& frame, RowPredictor& predictor,
                                  std::vector<Row>& rows, const std::vector<std::size_t>& slots,
                                  Finish&& finish) {
    std::vector<PositionRow*> positions;
    for (Row& row : rows) positions.push_back(&row);
    const std::vector<std::uint8_t> basis = predictor.move(frame, positions, slots);
    for (std::size_t i = 0; i < rows.size(); ++i) {
        DisplayRow written{rows[i]};
        written.display_ms = rows[i].timestamp_ms + delay_ms_;
        written.basis = basis_name(basis[i]);
        finish(rows[i], written);
        file_.add(written);
    }
}

std::vector<PointRow> DisplayPrediction::move(const FrameOutcome& frame,
                                              std::vector<PointRow> rows) {
    std::vector<std::size_t> slots;
    for (const PointRow& row : rows)
        slots.push_back(slots_.emplace(row.id, slots_.size()).first->second);
    move_rows(frame, points_, rows, slots,
              [](const PointRow&, DisplayRow& written) { written.kind = "point"; });
    return rows;
}

std::vector<TargetRow> DisplayPrediction::move(const FrameOutcome& frame,
                                               std::vector<TargetRow> rows) {
    move_rows(frame, targets_, rows, in_order(rows.size()),
              [](const TargetRow&, DisplayRow& written) { written.kind = "target"; });
    return rows;
}

PlanFrame DisplayPrediction::move(const FrameOutcome& frame, PlanFrame plan) {
    move_rows(frame, plan_rows_, plan.rows, in_order(plan.rows.size()),
              [](const PlanRow& row, DisplayRow& written) {
                  written.kind = row.part.empty() ? "plan-target" : "plan-part";
                  written.part = row.part;
                  written.target = row.target;
              });
    if (plan.points == nullptr) {
        // A frame without a plan is one that was lost: the predictor is told.
        if (!plan_predictor_) return plan;
        std::fill(plan_.status.begin(), plan_.status.end(), std::uint8_t{DEFREC_POINT_UNKNOWN});
    } else {
        plan_ = *plan.points;
    }
    if (plan_.status.empty()) return plan;
    if (!plan_predictor_)
        plan_predictor_ = std::make_unique<PointPredictor>(plan_.status.size(), delay_ms_);
    std::vector<std::uint8_t> basis;
    plan_predictor_->move(frame, plan_, basis);
    plan_.project(projection_);
    if (plan.points != nullptr) plan.points = &plan_;
    return plan;
}

}  // namespace defrec::cli
