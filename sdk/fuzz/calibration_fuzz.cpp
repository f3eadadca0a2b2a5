// A calibration: one file, or two with a zero byte between them.
#include <algorithm>

#include "sdk/fuzz/memory_file.hpp"
#include "sdk/io/calibration.hpp"
#include "sdk/io/exit_code.hpp"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    using namespace defrec;
    const std::span<const unsigned char> bytes(data, size);
    const auto zero = std::find(bytes.begin(), bytes.end(), 0);
    const fuzz::MemoryFile left({bytes.begin(), zero});
    const fuzz::MemoryFile right({zero == bytes.end() ? zero : zero + 1, bytes.end()});
    const bool is_pair = zero != bytes.end();
    try {
        cli::StereoCalibration calibration =
            cli::load_calibration(is_pair ? left.path() + "," + right.path() : left.path());
        cli::fit_to_frames(calibration, 960, 540);
        static_cast<void>(cli::is_rectified(calibration));
    } catch (const cli::CliError&) {
    }
    return 0;
}
