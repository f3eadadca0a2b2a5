// Which pairs of control points share a residual: the pattern of a symmetric block sparse matrix,
// rows with ascending columns.
#pragma once
#include <algorithm>
#include <iterator>

#include "backends/shared/stage.hpp"

namespace defrec {

class BlockPattern {
  public:
    explicit BlockPattern(const Host& host)
        : start_(HostAllocator<uint32_t>(host)), column_(HostAllocator<int32_t>(host)) {}

    // Starts a pattern with the diagonal only. Pairs follow with add, then finish.
    void begin(size_t rows) {
        rows_ = rows;
        pairs_.clear();
        for (size_t i = 0; i < rows; ++i) add(int32_t(i), int32_t(i));
    }
    void add(int32_t a, int32_t b) {
        pairs_.push_back({a, b});
        if (a != b) pairs_.push_back({b, a});
    }
    // Rows by counting, then each row by itself: most pairs are there many times.
    void finish() {
        start_.assign(rows_ + 1, 0);
        for (const auto& [row, column] : pairs_) ++start_[size_t(row) + 1];
        for (size_t i = 0; i < rows_; ++i) start_[i + 1] += start_[i];
        std::vector<int32_t> columns(pairs_.size());
        std::vector<uint32_t> next(start_.begin(), start_.end());
        for (const auto& [row, column] : pairs_) columns[next[size_t(row)]++] = column;
        pairs_ = {};
        column_.clear();
        auto row = columns.begin();
        for (size_t i = 0; i < rows_; ++i) {
            const auto end = columns.begin() + start_[i + 1];
            start_[i] = uint32_t(column_.size());
            std::sort(row, end);
            std::unique_copy(row, end, std::back_inserter(column_));
            row = end;
        }
        start_[rows_] = uint32_t(column_.size());
    }

    size_t rows() const { return rows_; }
    size_t blocks() const { return column_.size(); }
    // Blocks row_start(i) up to row_start(i + 1) belong to row i.
    size_t row_start(size_t row) const { return start_[row]; }
    int32_t column(size_t block) const { return column_[block]; }
    // The block of a pair that was added.
    size_t find(int32_t row, int32_t column) const {
        const auto first = column_.begin() + start_[size_t(row)],
                   last = column_.begin() + start_[size_t(row) + 1];
        return size_t(std::lower_bound(first, last, column) - column_.begin());
    }

  private:
    size_t rows_ = 0;
    HostVector<uint32_t> start_;
    HostVector<int32_t> column_;
    std::vector<std::pair<int32_t, int32_t>> pairs_;  // while it is built
};

}  // namespace defrec
