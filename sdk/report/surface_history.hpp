// The surfaces that the report can step through: a light mesh, quantised, evenly thinned.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "sdk/report/light_plan.hpp"
#include "sdk/report/record.hpp"
#include "sdk/report/surface_lattice.hpp"
#include "sdk/report/thinning.hpp"

namespace defrec::cli {

/// Expected errors are kept in steps of 0.02 mm; 254 stands for that and more, 255 for not known.
inline constexpr double kErrorStepMm = 0.02;

/// A mesh's positions as 16-bit steps inside its own box; 65535 in x: no position.
struct QuantisedPoints {
    std::array<float, 3> lowest{}, step{};
    std::vector<std::uint16_t> xyz;
};
QuantisedPoints quantise(const std::vector<float>& xyz);

/// Error ellipsoids of followed points.
struct Ellipsoids {
    QuantisedPoints points;            ///< centres; without position where the point is lost
    std::vector<std::int16_t> shapes;  ///< ellipsoid_shape of each
    std::vector<std::uint8_t> status;  ///< VertexStatus
};

struct SurfaceMoment {
    std::int64_t frame = 0;
    double timestamp_ms = 0;
    double mean_residual_mm = std::numeric_limits<double>::quiet_NaN();
    std::string state, reasons;
    std::array<double, 12> rigid{};
    QuantisedPoints points;                ///< empty: no surface in this frame
    std::vector<std::uint8_t> status;      ///< VertexStatus
    std::vector<std::uint8_t> error;       ///< steps of kErrorStepMm; empty: not known
    Ellipsoids ellipsoids;                 ///< of points
    Ellipsoids targets;                    ///< of targets
    QuantisedPoints plan;                  ///< of the light plan's vertices; empty: none, or lost
    std::vector<std::uint8_t> plan_error;  ///< as error
    Ellipsoids plan_targets;
};

struct TargetLabel {
    std::int64_t id = 0;
    float depth = 0;  ///< mm; NaN: not given
};

class SurfaceHistory {
  public:
    static constexpr std::size_t kMoments = 120;
    static constexpr double kPoints = 1900;
    static constexpr std::size_t kEllipsoids = 150;  ///< evenly chosen if more points are followed

    static constexpr std::size_t kTargets = 500;  ///< likewise

    void set_template(const TemplateRecord& reference);
    /// The same with tissue that joined it, whose vertices come last and are left out, or parted by
    /// a cut, which shows in all moments.
    void change_template(const TemplateRecord& reference);
    /// state: as it is said.
    void add(const FrameRecord& frame, const std::string& state);

    const SurfaceLattice& lattice() const { return lattice_; }
    const QuantisedPoints& rest() const { return rest_; }
    const EvenlyThinned<SurfaceMoment>& moments() const { return moments_; }
    /// Targets in the moments, in their order; and how many targets there are.
    const std::vector<TargetLabel>& target_labels() const { return target_labels_; }
    std::size_t target_count() const { return target_count_; }
    /// Empty where there is no plan.
    const LightPlan& plan() const { return plan_; }

  private:
    std::size_t vertices_ = 0;
    double step_ = 1;  ///< of the lattice, px
    SurfaceLattice lattice_;
    QuantisedPoints rest_;
    LatticeState state_;
    EvenlyThinned<SurfaceMoment> moments_{kMoments};
    std::vector<TargetLabel> target_labels_;
    std::size_t target_count_ = 0;
    LightPlan plan_;
};

}  // namespace defrec::cli
