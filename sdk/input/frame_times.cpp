// See frame_times.hpp.
#include "sdk/input/frame_times.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "sdk/base/util/median.hpp"
#include "sdk/io/csv.hpp"
#include "sdk/io/exit_code.hpp"

namespace defrec::cli {

std::vector<double> read_frame_times(const std::filesystem::path& path) {
    // Nanoseconds in 64 bits, and ms in a double, still hold each.
    constexpr double kLargest = 1e12;
    std::vector<double> times;
    CsvReader csv(path, {"frame", "timestamp_ms"});
    while (csv.next()) {
        if (csv.integer(0) != static_cast<std::int64_t>(times.size()))
            csv.fail("frame " + std::to_string(times.size()) +
                     " was expected: frames are numbered from 0 on, and none is left out.");
        const double time = csv.number(1);
        if (std::abs(time) > kLargest) csv.fail("timestamp_ms is beyond 1e12.");
        if (!times.empty() && !(time > times.back()))
            csv.fail("timestamp_ms is not after that of the frame before.");
        times.push_back(time);
    }
    if (times.empty())
        throw CliError(ExitCode::kInput, path.string() + ": there are no times of frames.");
    return times;
}

double rate_of(const std::vector<double>& times_ms) {
    constexpr double kMillisecondsInSecond = 1000;
    if (times_ms.size() < 2) return 0;
    std::vector<double> steps(times_ms.size() - 1);
    std::transform(times_ms.begin() + 1, times_ms.end(), times_ms.begin(), steps.begin(),
                   [](double later, double earlier) { return later - earlier; });
    return kMillisecondsInSecond / median(std::move(steps));
}

}  // namespace defrec::cli
