// The stages in the shape of host-memory backends, so that the same tests hold every backend to the reference (backends/agreement).
// Included by those who define device() and in_host_memory(): the emulated device and a GPU.
#pragma once

namespace defrec::under_test {

inline std::unique_ptr<Stage> make_rectify(const defrec_rectify_params& params, const Host&) {
    return in_host_memory(cuda::make_rectify(params, device()));
}
inline std::unique_ptr<Stage> make_stereo(const defrec_stereo_params& params, const Host&) {
    return in_host_memory(cuda::make_stereo(params, device()));
}
inline std::unique_ptr<Stage> make_orb(const defrec_orb_params& params, const Host&) {
    return in_host_memory(cuda::make_orb(params, device()));
}
inline std::unique_ptr<Stage> make_match(const defrec_match_params& params, const Host&) {
    return in_host_memory(cuda::make_match(params, device()));
}
inline std::unique_ptr<Stage> make_align(const defrec_align_params& params, const Host&) {
    return in_host_memory(cuda::make_align(params, device()));
}
inline std::unique_ptr<Stage> make_ransac(const defrec_ransac_params& params, const Host&) {
    return in_host_memory(cuda::make_ransac(params, device()));
}
inline std::unique_ptr<Stage> make_lm(const defrec_lm_params& params, const Host&) {
    return in_host_memory(cuda::make_lm(params, device()));
}
inline std::unique_ptr<Stage> make_warp(const defrec_warp_params& params, const Host&) {
    return in_host_memory(cuda::make_warp(params, device()));
}

}  // namespace defrec::under_test
