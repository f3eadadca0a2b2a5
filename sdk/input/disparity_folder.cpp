// See disparity_folder.hpp.
#include "sdk/input/disparity_folder.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <opencv2/core.hpp>
#include <string_view>

#include "sdk/input/decode_image.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/image_header.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const fs::path& file, const std::string& why) {
    throw CliError(ExitCode::kInput, file.string() + ": " + why);
}

void expect_size(const fs::path& file, std::uint64_t found_width, std::uint64_t found_height,
                 int width, int height) {
    if (found_width == static_cast<std::uint64_t>(width) &&
        found_height == static_cast<std::uint64_t>(height))
        return;
    refuse(file, "the disparity has " + std::to_string(found_width) + "x" +
                     std::to_string(found_height) + " pixels, the rectified left image " +
                     size_text(width, height) +
                     "; it must be of that image. Values of one that is scaled by s in x are s "
                     "times as large.");
}

// The next word of a header, behind blanks.
std::string_view take_word(std::string_view& text) {
    constexpr std::string_view kBlanks = " \t\r\n";
    const std::size_t begin = std::min(text.find_first_not_of(kBlanks), text.size());
    text.remove_prefix(begin);
    const std::size_t end = std::min(text.find_first_of(kBlanks), text.size());
    const std::string_view word = text.substr(0, end);
    text.remove_prefix(end);
    return word;
}

float float_at(const char* bytes, bool is_little_endian) {
    std::uint32_t bits = 0;
    std::memcpy(&bits, bytes, sizeof bits);
    if (!is_little_endian)
        bits = bits >> 24 | (bits >> 8 & 0xff00) | (bits << 8 & 0xff0000) | bits << 24;
    return std::bit_cast<float>(bits);
}

// Gray PFM: rows from the last one up; a negative scale says that bytes are little endian. What is
// not finite is none, as in Middlebury's files.
DisparityImage read_pfm(const fs::path& file, std::string_view text, int width, int height) {
    std::string_view rest = text;
    if (const std::string_view kind = take_word(rest); kind != "Pf")
        refuse(file, "a PFM of one channel was expected (it begins with Pf).");
    const auto columns = parse_integer(take_word(rest)), rows = parse_integer(take_word(rest));
    const auto scale = parse_double(take_word(rest));
    if (!columns || !rows || !scale || *scale == 0 || !std::isfinite(*scale) || *columns < 0 ||
        *rows < 0 || rest.empty())
        refuse(file, "its header is none of a PFM.");
    expect_size(file, static_cast<std::uint64_t>(*columns), static_cast<std::uint64_t>(*rows),
                width, height);
    rest.remove_prefix(1);  // one blank
    const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    if (rest.size() != pixels * sizeof(float))
        refuse(file, "it has " + std::to_string(rest.size()) + " bytes of disparity, " +
                         std::to_string(pixels * sizeof(float)) + " were expected.");
    constexpr float kMost = 2000;  // of defrec_disparity
    DisparityImage values(pixels);
    for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y)
        for (std::size_t x = 0; x < static_cast<std::size_t>(width); ++x) {
            const std::size_t from =
                (static_cast<std::size_t>(height) - 1 - y) * static_cast<std::size_t>(width) + x;
            const float value = float_at(rest.data() + from * sizeof(float), *scale < 0);
            if (value > kMost && std::isfinite(value))
                refuse(file, "the disparity of pixel (" + std::to_string(x) + ", " +
                                 std::to_string(y) + ") is " + format_fixed(double{value}, 3) +
                                 " px; up to 2000 px were expected.");
            if (value < 0 && std::isfinite(value))
                refuse(file, "the disparity of pixel (" + std::to_string(x) + ", " +
                                 std::to_string(y) + ") is " + format_fixed(double{value}, 3) +
                                 " px; 0, or inf, was expected where there is none, and else x in "
                                 "the left image less x in the right one.");
            values[y * static_cast<std::size_t>(width) + x] = std::isfinite(value) ? value : 0;
        }
    return values;
}

// As KITTI has it.
DisparityImage read_png(const fs::path& file, const std::string& text, int width, int height) {
    const std::vector<unsigned char> bytes(text.begin(), text.end());
    const std::optional<HeaderSize> claimed = image_header_size(bytes);
    if (!claimed) refuse(file, "it is no PNG.");
    expect_size(file, claimed->width, claimed->height, width, height);
    const cv::Mat image = decode_unchanged(bytes);
    if (image.empty()) refuse(file, "it is damaged or cut short.");
    if (image.type() != CV_16UC1)
        refuse(file,
               "a PNG of 16 bits and one channel was expected, of 1/256 px of disparity: 8 "
               "bits are a picture of disparities, too coarse to measure with.");
    constexpr float kUnit = 256;
    DisparityImage values;
    values.reserve(image.total());
    for (int y = 0; y < image.rows; ++y)
        for (int x = 0; x < image.cols; ++x)
            values.push_back(static_cast<float>(image.at<std::uint16_t>(y, x)) / kUnit);
    return values;
}

std::vector<std::string> runs_of_digits(const fs::path& file) {
    std::vector<std::string> runs;
    bool is_in_run = false;
    for (const char c : file.stem().string()) {
        const bool is_digit = c >= '0' && c <= '9';
        if (is_digit && !is_in_run) runs.emplace_back();
        if (is_digit) runs.back() += c;
        is_in_run = is_digit;
    }
    return runs;
}

std::string lower_extension(const fs::path& file) {
    std::string extension = file.extension().string();
    for (char& c : extension)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return extension;
}

}  // namespace

std::string digits_of(const fs::path& file) {
    std::string digits;
    for (const char c : file.stem().string())
        if (c >= '0' && c <= '9') digits += c;
    return digits;
}

std::vector<std::optional<std::int64_t>> numbers_of(const std::vector<fs::path>& files) {
    std::vector<std::vector<std::string>> runs;
    for (const fs::path& file : files) runs.push_back(runs_of_digits(file));
    const auto differs = [&](std::size_t at) {
        return std::any_of(runs.begin(), runs.end(),
                           [&](const auto& each) { return each[at] != runs[0][at]; });
    };
    const bool are_alike = std::all_of(
        runs.begin(), runs.end(), [&](const auto& each) { return each.size() == runs[0].size(); });
    std::optional<std::size_t> number;  // none: the last of each name
    if (are_alike && !runs.empty())
        for (std::size_t at = 0; at < runs[0].size(); ++at)
            if (differs(at)) number = at;
    std::vector<std::optional<std::int64_t>> numbers;
    for (const std::vector<std::string>& each : runs)
        numbers.push_back(each.empty() ? std::nullopt
                                       : parse_integer(number ? each[*number] : each.back()));
    return numbers;
}

DisparityFolder::DisparityFolder(const fs::path& folder) {
    std::error_code error;
    std::vector<fs::path> files;
    for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
         entry.increment(error)) {
        const fs::path& file = entry->path();
        const std::string extension = lower_extension(file);
        if (extension != ".png" && extension != ".pfm") continue;
        files.push_back(file);
    }
    if (error) refuse(folder, "the folder cannot be read: " + error.message() + ".");
    const std::vector<std::optional<std::int64_t>> numbers = numbers_of(files);
    for (std::size_t i = 0; i < files.size(); ++i) {
        if (!numbers[i]) refuse(files[i], "its name has no number of a frame.");
        const auto [place, is_new] = files_.emplace(*numbers[i], files[i]);
        if (!is_new)
            refuse(files[i], "it has the number of " + place->second.filename().string() + ".");
    }
    if (files_.empty()) refuse(folder, "there is no .pfm and no .png in this folder.");
}

std::shared_ptr<const DisparityImage> DisparityFolder::read(std::int64_t number, int width,
                                                            int height) const {
    const auto found = files_.find(number);
    if (found == files_.end()) return nullptr;
    const fs::path& file = found->second;
    constexpr std::size_t kMostBytes = std::size_t{1} << 30;
    const std::string text = read_file(file, kMostBytes, ExitCode::kInput);
    return std::make_shared<const DisparityImage>(lower_extension(file) == ".pfm"
                                                      ? read_pfm(file, text, width, height)
                                                      : read_png(file, text, width, height));
}

}  // namespace defrec::cli
