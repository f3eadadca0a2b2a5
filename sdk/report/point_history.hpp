// The report's data of the points that the user chose, and of a plan's parts and targets: where
// they were, and how sure that is.
#pragma once

#include <cstdint>
#include <string>
#include <unordered_set>
#include <vector>

#include "sdk/report/record.hpp"
#include "sdk/report/surface_history.hpp"
#include "sdk/report/thinning.hpp"

namespace defrec::cli {

/// Pixels are kept in steps of 0.25 px; kNoPixel stands for no place.
inline constexpr double kPixelStep = 0.25;
inline constexpr std::int16_t kNoPixel = -32768;
/// Expected errors are kept in steps of 0.002 mm; 65535 stands for that and more.
inline constexpr double kPointErrorStepMm = 0.002;

/// The listed points in one frame, in their order; those that came later are missing at the end.
struct PointMoment {
    std::int64_t frame = 0;
    double timestamp_ms = 0;
    std::vector<std::uint8_t> status;  ///< VertexStatus
    QuantisedPoints points;            ///< mm
    std::vector<std::int16_t> uv;      ///< steps of kPixelStep, left image as given
    std::vector<std::uint16_t> error;  ///< steps of kPointErrorStepMm
    /// The largest of this frame and of those before the next moment; 0: unknown in all of them.
    std::vector<std::uint16_t> largest;
};

/// One point over all its frames.
struct PointFacts {
    std::int64_t id = 0;
    std::string name;
    std::int64_t first_frame = 0;
    std::uint64_t frames[3] = {};  ///< by VertexStatus
    Distribution error_mm;
    double largest_mm = 0;
};

class PointHistory {
  public:
    static constexpr std::size_t kMoments = 240;
    static constexpr std::size_t kListed = 100;  ///< evenly chosen of those of the first frame

    explicit PointHistory(Projector projector);

    /// Points that the user chose count alone.
    void add(std::int64_t frame, double timestamp_ms, const std::vector<PointEstimate>& points);

    const std::vector<PointFacts>& listed() const { return facts_; }
    std::size_t count() const { return seen_.size(); }
    const EvenlyThinned<PointMoment>& moments() const { return moments_; }

  private:
    void choose(std::int64_t frame, const std::vector<PointEstimate>& points);
    PointMoment moment(std::int64_t frame, double timestamp_ms,
                       const std::vector<const PointEstimate*>& points) const;

    Projector projector_;
    std::vector<PointFacts> facts_;
    std::unordered_set<std::int64_t> seen_;  ///< ids
    EvenlyThinned<PointMoment> moments_{kMoments};
};

/// A plan's targets and the middles of its parts, as points that were chosen; their ids differ.
std::vector<PointEstimate> points_of_plan(const PlanEstimate& plan);

/// Largest and median expected error of the chosen points that are not lost, mm, NaN without any;
/// and how many are lost.
struct PointErrors {
    double median_mm = 0, largest_mm = 0;
    std::size_t chosen = 0, lost = 0;
};
PointErrors point_errors(const FrameRecord& frame);

}  // namespace defrec::cli
