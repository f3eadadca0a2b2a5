// Comma-separated files with a header line.
#include "sdk/io/csv.hpp"

#include <algorithm>
#include <cmath>

#include "sdk/io/exit_code.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

constexpr std::size_t kLargestFile = 2'000'000'000;
constexpr std::size_t kLongestHeader = 65536, kMostColumns = 1000;

// "; ..." to the message that the header lacks a column; `wanted`: those that it must have.
std::string remedy_of_header(const std::string& lacking, std::vector<std::string> header,
                             const std::vector<std::string>& wanted) {
    if (header.size() == 1 && header[0].find_first_of(";\t") != std::string::npos)
        return "; the file seems to part its columns by semicolons or tabs, commas were expected";
    const auto is_number = [](const std::string& field) { return parse_double(field).has_value(); };
    if (std::all_of(header.begin(), header.end(), is_number)) {
        std::string names;
        for (const std::string& name : wanted) names += (names.empty() ? "" : ",") + name;
        return "; the first line must name the columns: " + names;
    }
    const auto is_wanted = [&wanted](const std::string& name) {
        return std::find(wanted.begin(), wanted.end(), name) != wanted.end();
    };
    header.erase(std::remove_if(header.begin(), header.end(), is_wanted), header.end());
    const std::string nearest = nearest_name(lacking, header);
    return nearest.empty() ? std::string() : "; the nearest is '" + nearest + "'";
}

}  // namespace

CsvReader::CsvReader(const std::filesystem::path& path, const std::vector<std::string>& columns,
                     const std::vector<std::string>& optional)
    : path_(path.string()),
      text_(read_text_file(path, kLargestFile, ExitCode::kInput)),
      columns_(columns) {
    columns_.insert(columns_.end(), optional.begin(), optional.end());
    if (text_.empty()) {
        line_ = 1;
        fail("the file is empty; a header line was expected.");
    }
    std::vector<std::string> header;
    const std::string_view names = take_line();
    if (names.size() > kLongestHeader ||
        static_cast<std::size_t>(std::count(names.begin(), names.end(), ',')) >= kMostColumns)
        fail("the header has " + std::to_string(names.size()) + " bytes, at most " +
             std::to_string(kLongestHeader) + " and " + std::to_string(kMostColumns) +
             " columns were expected.");
    for (const std::string_view name : split(names, ',')) header.emplace_back(trim(name));
    width_ = header.size();
    for (const std::string& column : columns_) {
        const auto found = std::find(header.begin(), header.end(), column);
        if (found == header.end() && places_.size() >= columns.size()) {
            places_.emplace_back();
            continue;
        }
        if (found == header.end()) {
            fail("the header has no column '" + column + "'" +
                 remedy_of_header(column, header, columns) + ".");
        }
        places_.emplace_back(static_cast<std::size_t>(found - header.begin()));
    }
    fields_.resize(columns_.size());
}

std::string_view CsvReader::take_line() {
    const std::size_t end = std::min(text_.find('\n', position_), text_.size());
    const std::string_view line = std::string_view(text_).substr(position_, end - position_);
    position_ = std::min(end + 1, text_.size());
    ++line_;
    return line;
}

bool CsvReader::next() {
    while (position_ < text_.size()) {
        const std::string_view line = trim(take_line());
        if (line.empty()) continue;
        const std::vector<std::string_view> all = split(line, ',');
        if (all.size() != width_) {
            fail("the line has " + std::to_string(all.size()) + " fields, the header " +
                 std::to_string(width_) + ".");
        }
        for (std::size_t i = 0; i < places_.size(); ++i)
            if (places_[i]) fields_[i] = trim(all[*places_[i]]);
        return true;
    }
    return false;
}

double CsvReader::number(std::size_t column) const {
    const std::optional<double> value = parse_double(fields_[column]);
    if (!value || !std::isfinite(*value)) {
        fail(columns_[column] + ": '" + std::string(fields_[column].substr(0, 40)) +
             "' is not a finite number.");
    }
    return *value;
}

std::int64_t CsvReader::integer(std::size_t column) const {
    const std::optional<std::int64_t> value = parse_integer(fields_[column]);
    if (!value) {
        fail(columns_[column] + ": '" + std::string(fields_[column].substr(0, 40)) +
             "' is not a whole number.");
    }
    return *value;
}

void CsvReader::fail(const std::string& message) const {
    throw CliError(ExitCode::kInput, path_ + ":" + std::to_string(line_) + ": " + message);
}

void UniqueIds::add(const CsvReader& csv, std::int64_t id) {
    const auto [earlier, is_new] = line_of_.emplace(id, csv.line());
    if (!is_new) {
        csv.fail("id " + std::to_string(id) + " stands already in line " +
                 std::to_string(earlier->second) + ".");
    }
}

}  // namespace defrec::cli
