// See compare.hpp.
#include "conformance/compare/compare.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace defrec::conformance {

const Fields kFeatureFields = {{"x", 0, 1, 'i'},      {"y", 4, 1, 'i'},
                               {"level", 8, 1, 'h'},  {"angle", 10, 1, 'h'},
                               {"score", 12, 1, 'u'}, {"descriptor", 16, 8, 'u'}};
const Fields kMatchFields = {{"feature", 0, 1, 'i'}, {"distance", 4, 1, 'i'},
                             {"second", 8, 1, 'i'},  {"u", 12, 1, 'f'},
                             {"v", 16, 1, 'f'},      {"position", 20, 3, 'f'},
                             {"weight", 32, 1, 'f'}, {"reserved", 36, 1, 'u'}};
const Fields kPredictionFields = {{"u", 0, 1, 'i'},
                                  {"v", 4, 1, 'i'},
                                  {"view_from_live", 8, 4, 'i'},
                                  {"valid", 24, 1, 'i'},
                                  {"reserved", 28, 1, 'i'}};
const Fields kObservationFields = {{"u", 0, 1, 'i'},
                                   {"v", 4, 1, 'i'},
                                   {"score", 8, 1, 'i'},
                                   {"valid", 12, 1, 'i'},
                                   {"information", 16, 3, 'f'},
                                   {"reserved", 28, 1, 'u'}};

namespace {

template <class T>
T value_at(const Bytes& bytes, uint64_t at) {
    T value;
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return value;
}

std::string value_text(const Bytes& bytes, uint64_t at, char type) {
    switch (type) {
        case 'i':
            return concat(value_at<int32_t>(bytes, at));
        case 'u':
            return concat(value_at<uint32_t>(bytes, at));
        case 'h':
            return concat(value_at<uint16_t>(bytes, at));
        case 'f':
            return concat(value_at<float>(bytes, at));
        default:
            return concat(uint32_t(bytes[at]));
    }
}

// An image's element, of its 1, 2 or 4 bytes.
int64_t element_at(const Output& output, const Bytes& bytes, uint64_t element) {
    switch (output.element) {
        case 1:
            return int64_t(bytes[element]);
        case 2:
            return value_at<int16_t>(bytes, element * 2);
        default:
            return value_at<int32_t>(bytes, element * 4);
    }
}

// "features[12].descriptor[3] is 5, 7 expected".
std::string describe(const Output& output, const Fields& fields, const Bytes& expected,
                     const Bytes& found, uint64_t byte) {
    const uint64_t element = byte / output.element, inside = byte % output.element;
    if (output.width != 0)
        return concat(output.name, " at (", element % output.stride, ", ", element / output.stride,
                      ") is ", element_at(output, found, element), ", ",
                      element_at(output, expected, element), " expected");
    for (const Field& field : fields) {
        const uint32_t width = field.type == 'h' ? 2 : 4;
        if (inside < field.offset || inside >= field.offset + width * field.count) continue;
        const uint64_t index = (inside - field.offset) / width,
                       at = element * output.element + field.offset + index * width;
        return concat(output.name, "[", element, "].", field.name,
                      field.count > 1 ? concat("[", index, "]") : "", " is ",
                      value_text(found, at, field.type), ", ", value_text(expected, at, field.type),
                      " expected");
    }
    const bool whole = output.element <= 4;
    const uint64_t at = whole ? element * output.element : byte;
    const char type = output.element == 4 ? 'u' : output.element == 2 ? 'h' : 'b';
    return concat(output.name, "[", element, "]", whole ? "" : concat(", byte ", inside), " is ",
                  value_text(found, at, type), ", ", value_text(expected, at, type), " expected");
}

Picture gray_picture(const std::string& title, const Output& output,
                     const std::vector<double>& values, double minimum, double maximum) {
    Picture picture{title, output.width, output.height, {}};
    const double scale = maximum > minimum ? 255 / (maximum - minimum) : 0;
    for (const double value : values) {
        const bool none = std::isnan(value);
        const auto gray = uint8_t(none ? 0 : std::clamp((value - minimum) * scale, 0.0, 255.0));
        picture.pixels.insert(picture.pixels.end(),
                              {none ? uint8_t(90) : gray, gray, none ? uint8_t(120) : gray});
    }
    return picture;
}

std::vector<double> image_values(const Output& output, const Bytes& bytes) {
    std::vector<double> values;
    for (uint64_t y = 0; y < output.height; ++y)
        for (uint64_t x = 0; x < output.width; ++x) {
            const int64_t value = element_at(output, bytes, y * output.stride + x);
            const bool none = output.element == 2 && value == DEFREC_DISPARITY_NONE;
            values.push_back(none ? std::nan("") : double(value));
        }
    return values;
}

// Holes are violet; where the two differ the third picture is red, the brighter the farther.
void show_images(CaseRun& run, const Output& output, const Bytes& expected, const Bytes& found) {
    const std::vector<double> a = image_values(output, expected), b = image_values(output, found);
    double minimum = std::numeric_limits<double>::max(),
           maximum = std::numeric_limits<double>::lowest(), farthest = 0;
    for (size_t i = 0; i < a.size(); ++i) {
        if (!std::isnan(a[i])) minimum = std::min(minimum, a[i]), maximum = std::max(maximum, a[i]);
        if (!std::isnan(a[i]) && !std::isnan(b[i]))
            farthest = std::max(farthest, std::abs(a[i] - b[i]));
    }
    run.show(gray_picture(output.name + ", expected", output, a, minimum, maximum));
    run.show(gray_picture(output.name + ", found", output, b, minimum, maximum));
    Picture difference{output.name + ", difference", output.width, output.height, {}};
    for (size_t i = 0; i < a.size(); ++i) {
        const bool same = a[i] == b[i] || (std::isnan(a[i]) && std::isnan(b[i]));
        const bool hole = std::isnan(a[i]) != std::isnan(b[i]);
        const double share = same                    ? 0
                             : hole || farthest == 0 ? 1
                                                     : std::abs(a[i] - b[i]) / farthest;
        const auto red = uint8_t(same ? 0 : 80 + 175 * share);
        difference.pixels.insert(difference.pixels.end(), {red, uint8_t(hole ? 160 : 0), 0});
    }
    run.show(std::move(difference));
}

constexpr uint64_t kLargestPicture = 2'000'000;  // pixels

}  // namespace

void compare_exactly(CaseRun& run, const StageJob& job, size_t i, const Expected& expected,
                     const std::vector<Bytes>& found, const Fields& fields,
                     const std::vector<bool>& ignored) {
    const Output& output = job.out[i];
    const Bytes &a = expected.outputs[i], &b = found[i];
    uint64_t different = 0, samples = 0, first = 0;
    for (uint64_t byte = 0; byte < a.size(); ++byte) {
        if (!expected.written[i][byte] || (!ignored.empty() && ignored[byte % output.element]))
            continue;
        ++samples;
        if (a[byte] != b[byte] && different++ == 0) first = byte;
    }
    run.measure({output.name, "bytes", double(different), double(different), 0, 0, samples});
    if (different == 0) return;
    if (output.width != 0 && uint64_t(output.width) * output.height <= kLargestPicture)
        show_images(run, output, a, b);
    run.note_failure(concat(describe(output, fields, a, b, first), "; ", different, " of ", samples,
                            " bytes differ"));
}

double Distances::maximum() const {
    double maximum = 0;
    for (const double value : values_)
        maximum =
            std::isnan(value) || std::isnan(maximum) ? std::nan("") : std::max(maximum, value);
    return maximum;
}

double Distances::p99() const {
    if (values_.empty()) return 0;
    if (std::isnan(maximum())) return std::nan("");
    std::vector<double> sorted = values_;
    const auto rank = std::ptrdiff_t(std::ceil(0.99 * double(sorted.size()))) - 1;
    std::nth_element(sorted.begin(), sorted.begin() + rank, sorted.end());
    return sorted[size_t(rank)];
}

void Distances::measure(CaseRun& run) {
    const Tolerance& limit = run.tolerances().at(quantity_);
    run.measure({quantity_, limit.unit, maximum(), p99(), limit.maximum, limit.p99, samples()});
}

void require_finite(const char* what, std::span<const float> values) {
    for (size_t i = 0; i < values.size(); ++i)
        require(std::isfinite(values[i]), "value ", i, " of ", what, " is not a finite number");
}

}  // namespace defrec::conformance
