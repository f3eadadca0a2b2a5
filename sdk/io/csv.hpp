// Comma-separated files with a header line: columns by name, numbers independent of the locale, no
// quoting.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace defrec::cli {

// Every failure is a CliError(kInput) that names file and line.
class CsvReader {
  public:
    // Further columns than `columns` are allowed and left out; their order is free. optional: may
    // be missing, their fields are then empty; they come after `columns`.
    CsvReader(const std::filesystem::path& path, const std::vector<std::string>& columns,
              const std::vector<std::string>& optional = {});

    // Goes to the next line that is not empty; false at the end.
    bool next();
    int line() const { return line_; }
    // The field of the present line in the column given as columns[i], without surrounding blanks.
    std::string_view field(std::size_t column) const { return fields_[column]; }
    bool is_empty(std::size_t column) const { return fields_[column].empty(); }
    // A finite number.
    double number(std::size_t column) const;
    std::int64_t integer(std::size_t column) const;

    [[noreturn]] void fail(const std::string& message) const;

  private:
    std::string_view take_line();

    std::string path_, text_;
    std::size_t position_ = 0;
    int line_ = 0;
    std::vector<std::string> columns_;
    std::vector<std::optional<std::size_t>> places_;  // where in a line each column stands
    std::size_t width_ = 0;                           // fields in the header
    std::vector<std::string_view> fields_;
};

// Ids that stand in a file once.
class UniqueIds {
  public:
    // Fails where the id stands in an earlier line of the file.
    void add(const CsvReader& csv, std::int64_t id);

  private:
    std::unordered_map<std::int64_t, int> line_of_;
};

}  // namespace defrec::cli
