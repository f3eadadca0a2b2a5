// Run only by a test of its own, under the validation layers: they must see this fault, or their
// silence over all other tests says nothing.
#include <doctest/doctest.h>

#include "backends/vulkan/test_device.hpp"
#include "shaders.hpp"

using namespace defrec;
using namespace defrec::vulkan;

TEST_CASE("a shader reads what the one beside it writes" * doctest::skip()) {
    if (!under_test::available()) return;
    Device& device = under_test::device();
    const Buffer state(device, 256), next(device, 256);
    struct {
        int32_t width = 16, height = 16, unused[8] = {};
    } push;
    Recording recording(device);
    Recorder recorder(recording);
    recorder.dispatch(device.kernel(shaders::rectify_mask), {state, next}, push, {1, 2});
    recorder.beside(device.kernel(shaders::rectify_mask), {next, state}, push, {1, 2});
    recorder.finish();
}
