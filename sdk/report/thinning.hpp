// Bounded memory over sequences of any length: what is kept of frames, of plotted lines, and of
// distributions.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace defrec::cli {

/// Keeps between capacity / 2 and capacity items, every stride-th of those offered, the first
/// always.
template <typename Item>
class EvenlyThinned {
  public:
    explicit EvenlyThinned(std::size_t capacity) : capacity_(capacity) {}

    /// Asks about the next item; true: it is to be handed to keep(). Call once for each item
    /// offered.
    bool offer() { return offered_++ % stride_ == 0; }

    void keep(Item item) {
        keep(std::move(item), [](Item&, const Item&) {});
    }

    /// merge(kept, left_out): of an item that is left out and the one before it.
    template <typename Merge>
    void keep(Item item, Merge merge) {
        items_.push_back(std::move(item));
        if (items_.size() <= capacity_) return;
        std::size_t kept = 0;
        for (std::size_t i = 0; i < items_.size(); i += 2, ++kept) {
            if (i + 1 < items_.size()) merge(items_[i], items_[i + 1]);
            if (kept != i) items_[kept] = std::move(items_[i]);
        }
        items_.erase(items_.begin() + static_cast<std::ptrdiff_t>(kept), items_.end());
        stride_ *= 2;
    }

    /// Adds to the newest item what is known of one that was offered and not wanted.
    template <typename Merge>
    void add_to_last(const Item& left_out, Merge merge) {
        merge(items_.back(), left_out);
    }

    const std::vector<Item>& items() const { return items_; }
    std::uint64_t stride() const { return stride_; }

  private:
    std::size_t capacity_;
    std::uint64_t offered_ = 0, stride_ = 1;
    std::vector<Item> items_;
};

/// Quantiles of positive numbers to within 0.5 % of the value, in constant memory. Not finite
/// values are ignored; values are clamped to 1e-4..1e6.
class Distribution {
  public:
    void add(double value) {
        if (!std::isfinite(value)) return;
        const double bin = std::log(std::max(value, kLowest) / kLowest) / kLogWidth;
        ++counts_[std::min(counts_.size() - 1, static_cast<std::size_t>(bin))];
        ++total_;
    }

    std::uint64_t count() const { return total_; }

    /// share: 0..1. NaN if empty.
    double quantile(double share) const {
        std::uint64_t left = static_cast<std::uint64_t>(share * static_cast<double>(total_));
        for (std::size_t bin = 0; bin < counts_.size(); ++bin) {
            if (left < counts_[bin])
                return kLowest * std::exp((static_cast<double>(bin) + 0.5) * kLogWidth);
            left -= counts_[bin];
        }
        return total_ ? kLowest * std::exp(static_cast<double>(counts_.size()) * kLogWidth)
                      : std::nan("");
    }

  private:
    static constexpr double kLowest = 1e-4, kLogWidth = 0.01;
    std::array<std::uint64_t, 2304> counts_{};  // exp(23.04) spans 1e10
    std::uint64_t total_ = 0;
};

/// Plotted lines. One sample stands for `stride` frames and holds the worst of each line among
/// them.
class Series {
  public:
    enum class Worst { largest, smallest };

    explicit Series(std::size_t capacity) : capacity_(capacity) {}

    /// Index of a line; lines may come up after frames were added (NaN before).
    std::size_t line(const std::string& name, Worst worst);

    /// Begins a frame; then set() its values. Values not set are NaN.
    void begin(std::int64_t frame, double timestamp_ms);
    void set(std::size_t line, double value);

    struct Line {
        std::string name;
        Worst worst;
        std::vector<float> values;  ///< one for each sample; NaN: nothing known
    };
    const std::vector<Line>& lines() const { return lines_; }
    const std::vector<std::int64_t>& frames() const { return frames_; }
    const std::vector<double>& timestamps_ms() const { return timestamps_ms_; }
    std::uint64_t stride() const { return stride_; }

  private:
    void halve();

    std::size_t capacity_;
    std::uint64_t stride_ = 1, in_last_ = 0;
    std::vector<std::int64_t> frames_;
    std::vector<double> timestamps_ms_;
    std::vector<Line> lines_;
};

}  // namespace defrec::cli
