// What backends/agreement asks of a backend, where its stages run on a device and in_host_memory()
// shapes them like those of host-memory backends. Included by those who have in defrec::under_test
// that, device(), available(), kBackend, and the name `backend` for the namespace of the makers.
#pragma once

namespace defrec::under_test {

constexpr bool kReadsCounts = false;  // only the device knows the numbers in buffers

// Calls check() for everything that the backend's code may run on.
template <class Check>
void on_every_target(Check&& check) {
    check();
}

inline std::unique_ptr<Stage> make_rectify(const defrec_rectify_params& params, const Host&) {
    return in_host_memory(backend::make_rectify(params, device()));
}
inline std::unique_ptr<Stage> make_stereo(const defrec_stereo_params& params, const Host&) {
    return in_host_memory(backend::make_stereo(params, device()));
}
inline std::unique_ptr<Stage> make_orb(const defrec_orb_params& params, const Host&) {
    return in_host_memory(backend::make_orb(params, device()));
}
inline std::unique_ptr<Stage> make_match(const defrec_match_params& params, const Host&) {
    return in_host_memory(backend::make_match(params, device()));
}
inline std::unique_ptr<Stage> make_align(const defrec_align_params& params, const Host&) {
    return in_host_memory(backend::make_align(params, device()));
}
inline std::unique_ptr<Stage> make_ransac(const defrec_ransac_params& params, const Host&) {
    return in_host_memory(backend::make_ransac(params, device()));
}
inline std::unique_ptr<Stage> make_lm(const defrec_lm_params& params, const Host&) {
    return in_host_memory(backend::make_lm(params, device()));
}
inline std::unique_ptr<Stage> make_warp(const defrec_warp_params& params, const Host&) {
    return in_host_memory(backend::make_warp(params, device()));
}

}  // namespace defrec::under_test
