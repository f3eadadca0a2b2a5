// See written_files.hpp.
#include "sdk/session/written_files.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <system_error>
#include <vector>

#include "sdk/base/os/stdio_file.hpp"
#include "sdk/base/util/sha256.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/text.hpp"
#include "sdk/session/track_outputs.hpp"

namespace defrec::cli {
namespace {

nlohmann::ordered_json description_of(const std::filesystem::path& folder,
                                      const std::string& name) {
    constexpr std::size_t kPiece = std::size_t{1} << 20;
    const std::filesystem::path path = folder / name;
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(open_file(path), &std::fclose);
    Sha256 sum;
    std::uint64_t bytes = 0;
    std::vector<unsigned char> piece(kPiece);
    while (file) {
        const std::size_t count = std::fread(piece.data(), 1, piece.size(), file.get());
        sum.add({piece.data(), count});
        bytes += count;
        if (count < piece.size()) break;
    }
    if (!file || std::ferror(file.get()) != 0)
        throw CliError(ExitCode::kOutput,
                       path.string() + ": the file was written, but cannot be read.");
    return {{"name", name}, {"bytes", bytes}, {"sha256", sum.hex()}};
}

}  // namespace

void WrittenFiles::add(const std::string& name) { json_.push_back(description_of(folder_, name)); }

std::vector<std::string> not_as_summarised(const std::filesystem::path& folder,
                                           const std::vector<std::string>& names) {
    constexpr std::size_t kLargestSummary = 100'000'000;
    const std::filesystem::path path = folder / kSummaryFile;
    std::error_code error;
    if (!std::filesystem::exists(path, error)) return {};
    const auto summary = nlohmann::ordered_json::parse(
        read_text_file(path, kLargestSummary, ExitCode::kInput), nullptr, false);
    if (!summary.is_object() || !summary.contains("files") || !summary["files"].is_array())
        return {};
    std::vector<std::string> others;
    for (const std::string& name : names) {
        if (!std::filesystem::exists(folder / name, error)) continue;
        const auto& files = summary["files"];
        if (std::find(files.begin(), files.end(), description_of(folder, name)) == files.end())
            others.push_back(name);
    }
    return others;
}

}  // namespace defrec::cli
