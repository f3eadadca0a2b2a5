// A plan: a preoperative model and targets, registered to a template, and where they are in a
// frame with the errors of registration and tracking together.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "sdk/registration/registration.hpp"
#include "sdk/tracking/points/prepared_targets.hpp"
#include "sdk/tracking/tracker.hpp"

namespace defrec {

struct PlanPart {
    std::string name;
    uint64_t first_triangle = 0, triangle_count = 0;
};

// What a plan is made of and what its file holds; mm, model frame.
struct PlanData {
    RegistrationVerdict verdict = RegistrationVerdict::kRegistered;
    Pose pose;                                     // template frame from model frame
    TwistMatrix covariance = TwistMatrix::Zero();  // as Registration has it
    std::vector<float> vertices;                   // xyz each
    std::vector<uint32_t> triangles;               // three vertices each
    std::vector<PlanPart> parts;
    std::vector<double> targets;            // xyz each
    std::vector<std::string> target_names;  // of each, "": none; or empty: none has one
    // Places of the points by a registration that deformed the model, xyz, mm, template frame, and
    // six values of the covariance of its error, xx, xy, xz, yy, yz, zz, mm^2. Both empty: pose and
    // covariance say it.
    std::vector<double> deformed_places, deformed_covariances;

    // Vertices, then targets.
    size_t point_count() const { return (vertices.size() + targets.size()) / 3; }
    bool is_deformed() const { return !deformed_places.empty(); }
    // In the template frame.
    PlacedPoint at_rest(size_t point) const;
    // A point in the model frame.
    Eigen::Vector3d place(size_t point) const;

    // What is wrong with it, begins with its name and has the value; empty: nothing.
    std::string fault() const;
};

// The caller's arrays that points of a frame are written to; all but xyz may be null.
struct PlanPointArrays {
    double *xyz, *covariance;
    uint8_t* status;
    double* expected_error_mm;
};

// Covariance of a point in a frame, xx, xy, xz, yy, yz, zz: that of tracking and R C R^T. rotation:
// R, the tissue's since the template; registration: C, of the point at rest.
void add_registration_error(const Eigen::Matrix3d& rotation, const Eigen::Matrix3d& registration,
                            double* covariance);

// Any thread. Points are the vertices, then the targets.
class Plan {
  public:
    // Throws Error(DEFREC_ERROR_ARGUMENT) for data with a fault.
    Plan(std::shared_ptr<const Template> surface, PlanData data);

    const PlanData& data() const { return data_; }
    size_t point_count() const { return data_.point_count(); }
    // xyz each, template frame, mm.
    const std::vector<double>& at_rest() const { return at_rest_; }
    // Target registration error, per point.
    const std::vector<double>& registration_error_mm() const { return error_mm_; }

    // Throws what Job::move_targets throws.
    void move(const Job& job, const PlanPointArrays& arrays) const;

    // Throws Error(DEFREC_ERROR_IO).
    void save(const char* path) const;
    // Throws Error(DEFREC_ERROR_IO) for a file that is none, Error(DEFREC_ERROR_VERSION) for
    // another layout, Error(DEFREC_ERROR_ARGUMENT) for one of another template.
    static std::shared_ptr<const Plan> load(std::shared_ptr<const Template> surface,
                                            const char* path);

  private:
    std::shared_ptr<const Template> surface_;
    PlanData data_;
    std::vector<double> at_rest_, error_mm_;
    std::unique_ptr<const PreparedTargets> points_;
};

}  // namespace defrec
