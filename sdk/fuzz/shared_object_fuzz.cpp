// A plugin's library, as the loader looks at it before the dynamic one does.
#include "sdk/base/util/error.hpp"
#include "sdk/plugin/shared_object.hpp"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    try {
        defrec::check_shared_object("library", {data, size});
    } catch (const defrec::Error&) {
    }
    return 0;
}
