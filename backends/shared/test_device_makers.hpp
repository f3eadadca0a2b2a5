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

#define DEFREC_MAKER(name, NAME)                                                                   \
    inline std::unique_ptr<Stage> make_##name(const defrec_##name##_params& params, const Host&) { \
        return in_host_memory(backend::make_##name(params, device()));                             \
    }
DEFREC_STAGES(DEFREC_MAKER, DEFREC_NOTHING)
#undef DEFREC_MAKER

}  // namespace defrec::under_test
