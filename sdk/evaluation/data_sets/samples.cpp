// A table of numbers as CSV.
#include "sdk/evaluation/data_sets/samples.hpp"

#include <charconv>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/io/csv.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {

std::vector<double> means_of(const Samples& samples) {
    std::vector<double> means;
    for (std::size_t column = 1; column < samples.columns().size(); ++column) {
        double sum = 0, count = 0;
        for (std::size_t i = 0; i < samples.size(); ++i) {
            if (std::isnan(samples.at(i, column))) continue;
            sum += samples.at(i, column);
            ++count;
        }
        means.push_back(count > 0 ? sum / count : std::numeric_limits<double>::quiet_NaN());
    }
    return means;
}

std::string exact(double value) {
    if (std::isnan(value)) return {};
    char buffer[32];
    return {buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr};
}

void Samples::add(const std::vector<double>& row) {
    if (row.size() != columns_.size()) throw std::logic_error("a row of another width");
    values_.insert(values_.end(), row.begin(), row.end());
}

void Samples::append(const Samples& other) {
    if (other.columns_ != columns_) throw std::logic_error("samples of other columns");
    values_.insert(values_.end(), other.values_.begin(), other.values_.end());
}

void Samples::write(const std::filesystem::path& path) const {
    AtomicFile file(path);
    std::string line;
    for (const std::string& column : columns_) line.append(line.empty() ? "" : ",").append(column);
    line += '\n';
    file.write(line);
    for (std::size_t row = 0; row < size(); ++row) {
        line.clear();
        for (std::size_t column = 0; column < columns_.size(); ++column) {
            if (column > 0) line += ',';
            line += exact(at(row, column));
        }
        line += '\n';
        file.write(line);
    }
    file.commit();
}

void Samples::read(const std::filesystem::path& path) {
    CsvReader csv(path, columns_);
    while (csv.next()) {
        for (std::size_t column = 0; column < columns_.size(); ++column) {
            const std::string_view field = csv.field(column);
            const auto value =
                field.empty() ? std::numeric_limits<double>::quiet_NaN() : parse_double(field);
            if (!value) csv.fail(columns_[column] + " is not a number.");
            values_.push_back(*value);
        }
    }
}

}  // namespace defrec::cli
