// Times of recorded images, in a file beside them.
#pragma once

#include <filesystem>
#include <vector>

namespace defrec::cli {

// CSV with the columns frame and timestamp_ms: frames from 0 on, none left out, at times that grow;
// ms. Throws CliError(kInput), with file and line.
std::vector<double> read_frame_times(const std::filesystem::path& path);

// Images per second by the median step; 0 of fewer than two. times: as they are read.
double rate_of(const std::vector<double>& times_ms);

}  // namespace defrec::cli
