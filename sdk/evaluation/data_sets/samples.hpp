// What was measured in a clip: a table of numbers, kept as CSV beside the clip's other results and
// pooled over clips.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace defrec::cli {

class Samples {
  public:
    explicit Samples(std::vector<std::string> columns) : columns_(std::move(columns)) {}

    // As many as there are columns. NaN: there is none.
    void add(const std::vector<double>& row);
    // Adds the rows of samples with the same columns.
    void append(const Samples& other);

    std::size_t size() const { return values_.size() / columns_.size(); }
    double at(std::size_t row, std::size_t column) const {
        return values_[row * columns_.size() + column];
    }
    const std::vector<std::string>& columns() const { return columns_; }

    // Without loss: the same numbers come back. NaN is an empty field.
    void write(const std::filesystem::path& path) const;
    // Appends the rows of a file. Throws CliError(kInput).
    void read(const std::filesystem::path& path);

  private:
    std::vector<std::string> columns_;
    std::vector<double> values_;  // row by row
};

// Mean of the numbers of each column but the first; NaN where it has none.
std::vector<double> means_of(const Samples& samples);

// The shortest text that gives the same number back; empty for NaN.
std::string exact(double value);

}  // namespace defrec::cli
