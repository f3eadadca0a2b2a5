// Comparing a stage's outputs with the reference's: to the bit, or by how far values are apart.
#pragma once
#include <string>
#include <vector>

#include "conformance/worker/stage_job.hpp"

namespace defrec::conformance {

// A member of a record, for reasons that name it.
struct Field {
    const char* name;
    uint32_t offset, count;  // bytes; values
    char type;               // 'i' int32, 'u' uint32, 'h' uint16, 'f' float
};
using Fields = std::vector<Field>;
extern const Fields kFeatureFields, kMatchFields, kPredictionFields, kObservationFields;

// Every byte of output i that the reference writes, but those that ignored(byte) names, must be the
// same. Measures the number that differ; the first that does ends up in the reason, and an image in
// pictures.
void compare_exactly(CaseRun& run, const StageJob& job, size_t i, const Expected& expected,
                     const std::vector<Bytes>& found, const Fields& fields = {},
                     const std::vector<bool>& ignored = {});

// Distances of one quantity, of which the largest and the one that 99 % do not exceed are held
// against the tolerance.
class Distances {
  public:
    explicit Distances(std::string quantity) : quantity_(std::move(quantity)) {}
    void add(double distance) { values_.push_back(distance); }
    // Both the same, or apart by this much; NaN if one is no number.
    void add(double expected, double found) {
        add(expected == found ? 0 : std::abs(expected - found));
    }
    void measure(CaseRun& run);

    const std::string& quantity() const { return quantity_; }
    double maximum() const;
    double p99() const;
    uint64_t samples() const { return values_.size(); }

  private:
    std::string quantity_;
    std::vector<double> values_;
};

// Share of all floats that are no finite numbers must be none. what: the output's name.
void require_finite(const char* what, std::span<const float> values);

}  // namespace defrec::conformance
