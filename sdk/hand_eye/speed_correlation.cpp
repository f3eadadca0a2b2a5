// See speed_correlation.hpp. The sums over pairs are correlations themselves: of values, of their
// squares and of which values are known. All shifts of one come from three Fourier transforms, by
// the algorithm of Cooley and Tukey (An algorithm for the machine calculation of complex Fourier
// series, Mathematics of Computation 19, 1965).
#include "sdk/hand_eye/speed_correlation.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <utility>

#include "sdk/hand_eye/decisions.hpp"

namespace defrec {
namespace {

using Complex = std::complex<double>;
using Spectrum = std::vector<Complex>;

// Without the checks for infinity that the operator of std::complex makes.
Complex product(const Complex& a, const Complex& b) {
    return {a.real() * b.real() - a.imag() * b.imag(), a.real() * b.imag() + a.imag() * b.real()};
}

// Transforms of one length, a power of two.
class Fourier {
  public:
    explicit Fourier(std::size_t size) : size_(size), turn_(size / 2) {
        for (std::size_t k = 0; k < turn_.size(); ++k)
            turn_[k] = std::polar(
                1.0, -2 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(size));
    }
    Spectrum transformed(Spectrum values) const {
        for (std::size_t i = 0, mirrored = 0; i + 1 < size_; ++i) {
            if (i < mirrored) std::swap(values[i], values[mirrored]);
            std::size_t bit = size_ / 2;
            for (; (mirrored & bit) != 0; bit /= 2) mirrored ^= bit;
            mirrored |= bit;
        }
        for (std::size_t half = 1; half < size_; half *= 2)
            for (std::size_t first = 0; first < size_; first += 2 * half)
                for (std::size_t k = 0; k < half; ++k) {
                    Complex &low = values[first + k], &high = values[first + k + half];
                    const Complex turned = product(high, turn_[k * (size_ / 2 / half)]);
                    high = low - turned;
                    low += turned;
                }
        return values;
    }

  private:
    std::size_t size_;
    Spectrum turn_;
};

// The spectra of a series, in standard deviations from its mean, so that rounding is alike in all
// sums: of which values are known, of the values, of their squares; 0 where one is not.
struct Spectra {
    Spectrum known, value, square;

    Spectra(const std::vector<double>& series, std::size_t size, const Fourier& fourier) {
        double sum = 0, squared = 0, count = 0;
        for (const double x : series)
            if (!std::isnan(x)) {
                sum += x;
                ++count;
            }
        const double mean = count > 0 ? sum / count : 0;
        for (const double x : series)
            if (!std::isnan(x)) squared += (x - mean) * (x - mean);
        const double deviation = squared > 0 ? std::sqrt(squared / count) : 1;
        known.resize(size);
        value.resize(size);
        square.resize(size);
        for (std::size_t i = 0; i < series.size(); ++i) {
            if (std::isnan(series[i])) continue;
            const double x = (series[i] - mean) / deviation;
            known[i] = 1;
            value[i] = x;
            square[i] = x * x;
        }
        for (Spectrum* each : {&known, &value, &square})
            *each = fourier.transformed(std::move(*each));
    }
};

// Sums of a[i] b[i + shift] as real parts, of c[i] d[i + shift] as imaginary parts.
Spectrum sums(const Spectrum& a, const Spectrum& b, const Spectrum& c, const Spectrum& d,
              const Fourier& fourier) {
    Spectrum both(a.size());
    for (std::size_t i = 0; i < both.size(); ++i)
        both[i] = std::conj(product(std::conj(a[i]), b[i]) +
                            product({0, 1}, product(std::conj(c[i]), d[i])));
    both = fourier.transformed(std::move(both));
    for (Complex& each : both) each = std::conj(each) / static_cast<double>(both.size());
    return both;
}

}  // namespace

std::vector<double> correlations(const std::vector<double>& camera,
                                 const std::vector<double>& tracker, std::size_t min_count) {
    // No shift leads beyond the tracker's series, so that none wraps round.
    const std::size_t size = std::bit_ceil(std::max<std::size_t>(tracker.size(), 2));
    const Fourier fourier(size);
    const Spectra a(camera, size, fourier), b(tracker, size, fourier);
    const Spectrum count_and_ab = sums(a.known, b.known, a.value, b.value, fourier),
                   a_and_b = sums(a.value, b.known, a.known, b.value, fourier),
                   aa_and_bb = sums(a.square, b.known, a.known, b.square, fourier);
    std::vector<double> made(tracker.size() - camera.size() + 1,
                             std::numeric_limits<double>::quiet_NaN());
    const auto least = static_cast<double>(std::max<std::size_t>(min_count, 2));
    for (std::size_t shift = 0; shift < made.size(); ++shift) {
        const double n = std::round(count_and_ab[shift].real());
        if (n < least) continue;
        const double sum_a = a_and_b[shift].real(), sum_b = a_and_b[shift].imag(),
                     var_a = aa_and_bb[shift].real() - sum_a * sum_a / n,
                     var_b = aa_and_bb[shift].imag() - sum_b * sum_b / n;
        if (std::min(var_a, var_b) <= decisions::HandEyeOffset::kMinVariance * n) continue;
        made[shift] = (count_and_ab[shift].imag() - sum_a * sum_b / n) / std::sqrt(var_a * var_b);
    }
    return made;
}

}  // namespace defrec
