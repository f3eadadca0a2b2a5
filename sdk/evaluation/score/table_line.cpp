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

}  // namespace defrec::cli
