// The device that tests of the Vulkan backend run on, and its stages in the shape of host-memory backends, so that the same tests hold
// every backend to the reference (backends/agreement).
#pragma once
#include <memory>

#include "backends/vulkan/stages.hpp"

namespace defrec::under_test {

constexpr const char* kBackend = "vulkan";
constexpr bool kReadsCounts = false;  // only the device knows the numbers in buffers

// False, with a message, where there is no device to test on.
bool available();
vulkan::Device& device();
// The same for tests that open it themselves.
std::shared_ptr<const vulkan::Driver> driver();
size_t device_index();

// Calls check() for everything that the backend's code may run on.
template <class Check>
void on_every_target(Check&& check) {
    check();
}

std::unique_ptr<Stage> in_host_memory(std::unique_ptr<vulkan::Stage> stage);

inline std::unique_ptr<Stage> make_rectify(const defrec_rectify_params& params, const Host&) {
    return in_host_memory(vulkan::make_rectify(params, device()));
}
inline std::unique_ptr<Stage> make_stereo(const defrec_stereo_params& params, const Host&) {
    return in_host_memory(vulkan::make_stereo(params, device()));
}
inline std::unique_ptr<Stage> make_orb(const defrec_orb_params& params, const Host&) {
    return in_host_memory(vulkan::make_orb(params, device()));
}
inline std::unique_ptr<Stage> make_match(const defrec_match_params& params, const Host&) {
    return in_host_memory(vulkan::make_match(params, device()));
}
inline std::unique_ptr<Stage> make_align(const defrec_align_params& params, const Host&) {
    return in_host_memory(vulkan::make_align(params, device()));
}
inline std::unique_ptr<Stage> make_ransac(const defrec_ransac_params& params, const Host&) {
    return in_host_memory(vulkan::make_ransac(params, device()));
}
inline std::unique_ptr<Stage> make_lm(const defrec_lm_params& params, const Host&) {
    return in_host_memory(vulkan::make_lm(params, device()));
}
inline std::unique_ptr<Stage> make_warp(const defrec_warp_params& params, const Host&) {
    return in_host_memory(vulkan::make_warp(params, device()));
}

}  // namespace defrec::under_test
