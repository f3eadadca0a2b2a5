// Results of any numbers and lengths as the messages of the live link: each has a whole header, and
// together they are all that is sent.
#include <algorithm>
#include <cstring>
#include <string>

#include "sdk/fuzz/input.hpp"
#include "sdk/live_link/messages.hpp"

namespace {

using defrec::cli::LinkPoint;
using defrec::cli::LinkTarget;
using defrec::fuzz::Input;

// Seldom more than a few of the numbers are special.
float real(Input& input) {
    if (input.flag()) return static_cast<float>(input.real(-200, 200));
    const auto bits = input.number<uint32_t>();
    float value;
    std::memcpy(&value, &bits, sizeof value);
    return value;
}
std::vector<float> reals(Input& input, size_t count) {
    std::vector<float> values(count);
    for (float& value : values) value = real(input);
    return values;
}
// As many as they should be, or any number.
size_t length(Input& input, size_t count) {
    return input.number<uint32_t>(0, 15) > 0 ? count : input.number<size_t>(0, 20);
}

defrec::cli::LinkFrame make_frame(Input& input) {
    static const char* const kStatus[] = {"tracked", "extrapolated", ""};
    defrec::cli::LinkFrame frame;
    frame.index = input.number<int64_t>();
    frame.timestamp_ns = input.number<int64_t>();
    frame.state = input.number<uint32_t>(0, 6);
    frame.reasons = input.number<uint32_t>();
    frame.epoch = input.number<uint32_t>();
    frame.has_geometry = input.flag();
    for (double& value : frame.rigid_motion) value = real(input);
    const auto count = input.number<size_t>(0, 12);
    frame.vertex_status = input.bytes(length(input, count));
    frame.vertex_evidence = input.bytes(length(input, count));
    frame.vertices = reals(input, length(input, 3 * count));
    frame.expected_error_mm = reals(input, length(input, count));
    frame.vertex_covariance = reals(input, length(input, 6 * count));
    if (input.flag()) {
        std::vector<uint32_t> triangles(length(input, 3 * input.number<size_t>(0, 8)));
        for (uint32_t& vertex : triangles)
            vertex = input.number<uint32_t>(0, static_cast<uint32_t>(count));
        frame.triangles = std::make_shared<const std::vector<uint32_t>>(std::move(triangles));
    }
    const auto point = [&input]() -> LinkPoint {
        return {input.number<int64_t>(),
                input.one_of(kStatus),
                {real(input), real(input), real(input)},
                real(input)};
    };
    for (auto points = input.number<uint32_t>(0, 5); points > 0; --points)
        frame.points.push_back(point());
    for (auto targets = input.number<uint32_t>(0, 5); targets > 0; --targets) {
        LinkTarget target{point()};
        for (float& value : target.covariance) value = real(input);
        frame.targets.push_back(target);
    }
    return frame;
}

// OpenIGTLink's header, version 1, has the size of the body at 42, 8 bytes, the highest first.
uint64_t body_size(const std::string& bytes, size_t header) {
    uint64_t size = 0;
    for (size_t i = 0; i < 8; ++i) size = size << 8 | static_cast<uint8_t>(bytes[header + 42 + i]);
    return size;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    constexpr size_t kHeader = 58;
    Input input(data, size);
    const std::string bytes = defrec::cli::pack_messages(make_frame(input));
    size_t at = 0, messages = 0;
    for (; at < bytes.size(); ++messages) {
        if (bytes.size() - at < kHeader || bytes[at] != 0 || bytes[at + 1] != 1) __builtin_trap();
        const uint64_t body = body_size(bytes, at);
        if (body > bytes.size() - at - kHeader) __builtin_trap();
        at += kHeader + body;
    }
    if (messages < 1 || messages > 6) __builtin_trap();
    return 0;
}
