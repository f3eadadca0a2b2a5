// One line of a table as text.
#include "sdk/evaluation/score/table_line.hpp"

#include <cmath>

#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

constexpr std::size_t kNameWidth = 26, kColumnWidth = 11;

}  // namespace

TableLine::TableLine(const std::string& name) : text_(name) {
    if (text_.size() < kNameWidth) text_.append(kNameWidth - text_.size(), ' ');
}

TableLine& TableLine::text(const std::string& column) {
    if (column.size() < kColumnWidth) text_.append(kColumnWidth - column.size(), ' ');
    text_ += column;
    return *this;
}

TableLine& TableLine::count(std::size_t value) { return text(std::to_string(value)); }

TableLine& TableLine::number(double value, int decimals) {
    return text(std::isnan(value) ? "-" : format_fixed(value, decimals));
}

TableLine& TableLine::percent(double share) {
    return text(std::isnan(share) ? "-" : format_fixed(100 * share, 2) + " %");
}

std::string table_header(const std::string& name, const std::vector<std::string>& columns) {
    TableLine line(name);
    for (const std::string& column : columns) line.text(column);
    return line.end();
}

namespace {

// Rounded up, so that "within" holds.
std::string within_text(double mm) {
    return "within " + format_fixed(std::ceil(100 * mm - 1e-9) / 100, 2) + " mm";
}

std::string lost_text(double share) {
    constexpr double kLeast = 0.001;
    if (share > 0 && share < kLeast) return "less than 0.1 %";
    return format_fixed(100 * share, share > 0 && share < 1 ? 1 : 0) + " %";
}

}  // namespace

std::string verdict_on(const std::string& what, const ErrorSummary& errors, std::size_t lost,
                       std::size_t rows) {
    const std::string median =
        within_text(errors.median) + " of the truth, 95 % " + within_text(errors.p95);
    const std::string share = lost_text(static_cast<double>(lost) / static_cast<double>(rows));
    if (lost == 0)
        return "Half of the " + what + " were " + median + "; " + share + " were lost.\n";
    return "Of the " + what + " " + share + " were lost; half of the others were " + median + ".\n";
}

}  // namespace defrec::cli
