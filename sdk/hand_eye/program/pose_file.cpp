// See pose_file.hpp.
#include "sdk/hand_eye/program/pose_file.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "sdk/hand_eye/program/decisions.hpp"
#include "sdk/io/csv.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

using decisions::HandEyeFiles;

constexpr std::size_t kColumns = 8;
constexpr std::array<const char*, kColumns> kNames = {"time_s", "x",  "y",  "z",
                                                      "qx",     "qy", "qz", "qw"};

double millimetres(PoseUnit unit) {
    return unit == PoseUnit::kMillimetre ? 1 : unit == PoseUnit::kCentimetre ? 10 : 1000;
}

// Adds a line's pose; returns what is wrong with it, empty: nothing.
std::string add(PoseFile& file, const std::array<double, kColumns>& line, bool is_ordered) {
    Eigen::Quaterniond rotation(line[7], line[4], line[5], line[6]);
    const double length = rotation.norm();
    if (!(std::abs(length - 1) <= HandEyeFiles::kQuaternion))
        return "qx,qy,qz,qw is no rotation: its length is " + format_fixed(length, 4) +
               ", expected 1.";
    if (is_ordered && !file.times_s.empty() && !(line[0] > file.times_s.back()))
        return "the time " + format_fixed(line[0], 6) +
               " s is not after that of the pose before, " + format_fixed(file.times_s.back(), 6) +
               " s.";
    const Eigen::Matrix3d matrix = rotation.normalized().toRotationMatrix();
    file.times_s.push_back(line[0]);
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) file.poses.push_back(matrix(row, column));
        file.poses.push_back(millimetres(file.unit) * line[1 + static_cast<std::size_t>(row)]);
    }
    return {};
}

// Its fields, which blanks separate.
std::vector<std::string_view> words(std::string_view line) {
    std::vector<std::string_view> made;
    for (const std::string_view word : split(line, ' '))
        if (!trim(word).empty()) made.push_back(trim(word));
    return made;
}

// The next line that is neither empty nor a comment.
class TumLines {
  public:
    explicit TumLines(std::string_view text) : text_(text) {}
    bool next() {
        while (at_ < text_.size()) {
            const std::size_t end = std::min(text_.find('\n', at_), text_.size());
            line_ = trim(text_.substr(at_, end - at_));
            at_ = end + 1;
            ++number_;
            if (!line_.empty() && line_.front() != '#') return true;
        }
        return false;
    }
    std::string_view line() const { return line_; }
    int number() const { return number_; }

  private:
    std::string_view text_, line_;
    std::size_t at_ = 0;
    int number_ = 0;
};

// A header of CSV has names.
bool is_tum(std::string_view text) {
    TumLines lines(text);
    if (!lines.next()) return false;
    const std::vector<std::string_view> fields = words(lines.line());
    return !fields.empty() && parse_double(fields.front()).has_value();
}

void read_tum(PoseFile& file, const std::string& name, std::string_view text, bool is_ordered) {
    TumLines lines(text);
    while (lines.next()) {
        const auto refuse = [&](const std::string& fault) {
            throw CliError(ExitCode::kInput,
                           name + ":" + std::to_string(lines.number()) + ": " + fault);
        };
        const std::vector<std::string_view> fields = words(lines.line());
        if (fields.size() != kColumns)
            refuse("the line has " + std::to_string(fields.size()) +
                   " numbers, expected 8: time x y z qx qy qz qw.");
        std::array<double, kColumns> line{};
        for (std::size_t i = 0; i < kColumns; ++i) {
            const std::optional<double> value = parse_double(fields[i]);
            if (!value || !std::isfinite(*value))
                refuse(std::string(kNames[i]) + ": '" + printable(fields[i].substr(0, 40)) +
                       "' is not a finite number.");
            line[i] = *value;
        }
        const std::string fault = add(file, line, is_ordered);
        if (!fault.empty()) refuse(fault);
    }
}

void read_csv(PoseFile& file, const std::filesystem::path& path, bool is_ordered) {
    CsvReader csv(path, {kNames.begin(), kNames.end()});
    while (csv.next()) {
        std::array<double, kColumns> line{};
        for (std::size_t i = 0; i < kColumns; ++i) line[i] = csv.number(i);
        const std::string fault = add(file, line, is_ordered);
        if (!fault.empty()) csv.fail(fault);
    }
}

}  // namespace

const char* name_of(PoseUnit unit) {
    return unit == PoseUnit::kMillimetre ? "mm" : unit == PoseUnit::kCentimetre ? "cm" : "m";
}

PoseFile read_timed_poses(const std::filesystem::path& path, std::optional<PoseUnit> unit,
                          bool is_ordered) {
    std::string text = read_text_file(path, HandEyeFiles::kMaxBytes, ExitCode::kInput);
    std::replace(text.begin(), text.end(), '\t', ' ');
    PoseFile file;
    file.is_tum = is_tum(text);
    file.unit = unit.value_or(file.is_tum ? PoseUnit::kMetre : PoseUnit::kMillimetre);
    if (file.is_tum) {
        read_tum(file, path.string(), text, is_ordered);
    } else {
        read_csv(file, path, is_ordered);
    }
    if (file.times_s.empty())
        throw CliError(ExitCode::kInput, path.string() + ": there are no poses.");
    return file;
}

}  // namespace defrec::cli
