// Does the device compute what the exact stages rest on (docs/numerics.md) as the definition says?
// A driver that contracts where it must not, or whose compiler is wrong, is found before anybody
// trusts its results.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace defrec::vulkan {

class Device;

struct KnownAnswers {
    std::vector<uint32_t> words;
    std::vector<uint8_t> bytes;
    std::vector<int16_t> shorts;
};

KnownAnswers expected_answers();
// Runs the shader, and waits.
KnownAnswers computed_answers(Device& device);
// "" if they are equal, else how many of which kind are not.
std::string difference(const KnownAnswers& expected, const KnownAnswers& computed);

// The same of packed dot products, for a device that has them.
std::vector<int32_t> expected_packed_dots();
std::vector<int32_t> computed_packed_dots(Device& device);

// Throws StageError(DEFREC_ERROR_UNSUPPORTED) with the error message. With packed dot products that
// are wrong, a logical device has none from then on.
void check_known_answers(Device& device);

}  // namespace defrec::vulkan
