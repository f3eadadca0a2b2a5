// What `defrec score` reads: points.csv, frames.csv, summary.json and the truth, with a zero byte
// after each.
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string_view>

#include "sdk/evaluation/score/score.hpp"
#include "sdk/io/exit_code.hpp"

namespace {

std::filesystem::path make_folder() {
    std::string name = "/dev/shm/defrec-score-fuzz-XXXXXX";
    if (mkdtemp(name.data()) == nullptr) std::abort();
    return name;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    using namespace defrec;
    static const std::filesystem::path folder = make_folder();
    std::string_view text(reinterpret_cast<const char*>(data), size);
    for (const char* name : {"points.csv", "frames.csv", "summary.json", "truth.csv"}) {
        const size_t end = std::min(text.find('\0'), text.size());
        std::ofstream(folder / name, std::ios::binary) << text.substr(0, end);
        if (end == 0) std::filesystem::remove(folder / name);
        text.remove_prefix(std::min(end + 1, text.size()));
    }
    try {
        const cli::ScoredRows rows =
            cli::read_scored_rows(folder, folder / "truth.csv", cli::FrameRange{});
        for (const cli::ScoredRow& row : rows.rows)
            if (row.error_mm && !(*row.error_mm >= 0)) __builtin_trap();
    } catch (const cli::CliError&) {
    }
    return 0;
}
