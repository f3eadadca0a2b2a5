// `defrec record`: both views and their times in a folder, without loss unless H.264 was asked for.
#pragma once

#include <cstddef>
#include <string>

#include "sdk/input/frame_source.hpp"

namespace defrec::cli {

enum class RecordFormat { kPng, kPnm, kH264 };

struct RecordOptions {
    SourceOptions source;
    std::string out;
    RecordFormat format = RecordFormat::kPng;
    std::size_t queue_mb = 512;  // of images that may wait for the disk
    unsigned threads = 0;        // that compress; 0: one for each core
    bool quiet = false, json = false;
};

// Returns the exit code: 0, 3 when the input ended early, 130 when interrupted; in all cases the
// folder holds a recording of the frames until then. Throws CliError for everything else.
int run_record(const RecordOptions& options);

}  // namespace defrec::cli
