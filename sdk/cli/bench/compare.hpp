// A run of `defrec bench` beside one recorded earlier.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace defrec::cli {

// One stage, or the whole frame; ms.
struct ComparedTime {
    std::string name;
    std::optional<double> recorded, present;  // medians; none where the run did not have the stage
    double noise = 0;                         // of the difference, see difference_noise()
    bool is_beyond = false;                   // slower by more than the limit and the noise
};

// Medians may differ by this much without a cause, in one of twenty runs: twice the noises of both
// runs' medians (`noise_ms`), added in quadrature.
double difference_noise(double recorded, double present);

// What bench wrote with --json. Throws CliError(kInput) where the file is none.
nlohmann::ordered_json read_recorded_run(const std::filesystem::path& path);

// Throws CliError(kUsage) where the runs are of another frame size or sequence.
void check_comparable(const nlohmann::ordered_json& recorded,
                      const nlohmann::ordered_json& present);

// limit: share of the recorded time by which a stage may be slower. The runs are comparable.
std::vector<ComparedTime> compare_runs(const nlohmann::ordered_json& recorded,
                                       const nlohmann::ordered_json& present, double limit);
bool any_beyond(const std::vector<ComparedTime>& times);

std::string comparison_text(const std::vector<ComparedTime>& times, double limit);
nlohmann::ordered_json comparison_json(const std::vector<ComparedTime>& times);

}  // namespace defrec::cli
