// See result_files.hpp.
#include "sdk/evaluation/result_files.hpp"

#include <fstream>
#include <string>
#include <string_view>

#include "sdk/io/exit_code.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

struct ResultFile {
    const char* name;
    std::string_view first;  // what a line has that is among the first ones
};

constexpr ResultFile kFiles[] = {{"results.csv", "variant,clip,status,"},
                                 {"summary.csv", "variant,clips,"},
                                 {"results_by_depth.csv", "variant,clip,depth,"},
                                 {"summary_by_depth.csv", "variant,depth,"},
                                 {"times.csv", "variant,clip,frames,"},
                                 {"effects.csv", "variant,metric,"},
                                 {"evaluation.html", "<title>defrec: evaluation</title>"}};

bool is_of_an_evaluation(const fs::path& path, std::string_view first) {
    constexpr int kFirstLines = 10;
    std::ifstream file(path);
    std::string line;
    for (int i = 0; i < kFirstLines && std::getline(file, line); ++i)
        if (line.find(first) != std::string::npos) return true;
    return false;
}

}  // namespace

void check_result_files(const fs::path& out) {
    for (const auto& [name, first] : kFiles) {
        std::error_code error;
        const fs::path path = out / name;
        if (!fs::exists(path, error) || is_of_an_evaluation(path, first)) continue;
        throw CliError(ExitCode::kUsage,
                       path.string() +
                           ": this file is no result of an evaluation, and would be overwritten; "
                           "choose another folder with --out.");
    }
}

void remove_result_files(const fs::path& out) {
    for (const ResultFile& file : kFiles) {
        std::error_code error;
        fs::remove(out / file.name, error);
        if (error)
            throw CliError(ExitCode::kOutput, (out / file.name).string() +
                                                  ": what an earlier evaluation left cannot be "
                                                  "removed (" +
                                                  error.message() + ").");
    }
}

}  // namespace defrec::cli
