// How far results of the float stages lie from the reference's, quantity by quantity: what the
// stage tier holds against the tolerances, and what the tolerances are derived from.
#pragma once
#include <functional>
#include <map>
#include <string>

#include "conformance/compare/compare.hpp"

namespace defrec::conformance {

// Quantities by name; "warp.position".
class Spread {
  public:
    Distances& operator[](const std::string& quantity) {
        return all_.try_emplace(quantity, quantity).first->second;
    }
    const std::map<std::string, Distances>& all() const { return all_; }
    void measure(CaseRun& run) {
        for (auto& [name, distances] : all_) distances.measure(run);
    }

  private:
    std::map<std::string, Distances> all_;
};

// Each adds the distances between two results of its stage; throws CaseFailure where something that
// is no matter of tolerance differs or is no finite number. params: of the job.
using SpreadOf = void (*)(const StageJob& job, const std::vector<Bytes>& expected,
                          const std::vector<Bytes>& found, Spread& spread);
void match_spread(const StageJob& job, const std::vector<Bytes>& expected,
                  const std::vector<Bytes>& found, Spread& spread);
void align_spread(const StageJob& job, const std::vector<Bytes>& expected,
                  const std::vector<Bytes>& found, Spread& spread);
void ransac_spread(const StageJob& job, const std::vector<Bytes>& expected,
                   const std::vector<Bytes>& found, Spread& spread);
// For points of which no single rotation follows.
void ransac_weight_spread(const StageJob& job, const std::vector<Bytes>& expected,
                          const std::vector<Bytes>& found, Spread& spread);
void lm_spread(const StageJob& job, const std::vector<Bytes>& expected,
               const std::vector<Bytes>& found, Spread& spread);
void warp_spread(const StageJob& job, const std::vector<Bytes>& expected,
                 const std::vector<Bytes>& found, Spread& spread);

}  // namespace defrec::conformance
