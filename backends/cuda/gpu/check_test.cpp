#include "backends/cuda/gpu/check.hpp"

#include <doctest/doctest.h>

#include <array>
#include <optional>

#include "backends/cuda/gpu/test_device.hpp"

using namespace defrec;

namespace {

struct Row {
    cudaError_t error;
    defrec_status status;
};
constexpr std::array kRows{
    Row{cudaErrorMemoryAllocation, DEFREC_ERROR_OUT_OF_MEMORY},
    Row{cudaErrorInsufficientDriver, DEFREC_ERROR_UNSUPPORTED},
    Row{cudaErrorNoDevice, DEFREC_ERROR_UNSUPPORTED},
    Row{cudaErrorDevicesUnavailable,
        DEFREC_ERROR_UNSUPPORTED},  // another process has it for itself
    Row{cudaErrorNoKernelImageForDevice, DEFREC_ERROR_UNSUPPORTED},
    Row{cudaErrorCooperativeLaunchTooLarge, DEFREC_ERROR_UNSUPPORTED},
    Row{cudaErrorIllegalAddress, DEFREC_ERROR_DEVICE_LOST},
    Row{cudaErrorMisalignedAddress, DEFREC_ERROR_DEVICE_LOST},
    Row{cudaErrorIllegalInstruction, DEFREC_ERROR_DEVICE_LOST},
    Row{cudaErrorLaunchFailure, DEFREC_ERROR_DEVICE_LOST},
    Row{cudaErrorLaunchTimeout, DEFREC_ERROR_DEVICE_LOST},
    Row{cudaErrorECCUncorrectable, DEFREC_ERROR_DEVICE_LOST},
    Row{cudaErrorContextIsDestroyed, DEFREC_ERROR_DEVICE_LOST},  // the application reset the device
    Row{cudaErrorUnknown, DEFREC_ERROR_DEVICE_LOST},             // a card that fell off the bus
    Row{cudaErrorInvalidValue, DEFREC_ERROR_INTERNAL},
    Row{cudaErrorInvalidConfiguration, DEFREC_ERROR_INTERNAL},
    Row{cudaErrorInvalidResourceHandle, DEFREC_ERROR_INTERNAL},
};

std::optional<StageError> thrown_for(cudaError_t error) {
    try {
        cuda::check(error, "cudaSomething");
    } catch (const StageError& result) {
        return result;
    }
    return std::nullopt;
}

}  // namespace

TEST_CASE(
    "what CUDA answers becomes a status and an error message that names the call and the error") {
    CHECK(!thrown_for(cudaSuccess));
    for (const Row& row : kRows) {
        CAPTURE(cudaGetErrorName(row.error));
        const std::optional<StageError> error = thrown_for(row.error);
        REQUIRE(error);
        CHECK(error->status() == row.status);
        CHECK(cuda::status_of(row.error) == row.status);
        const std::string text = error->what();
        CHECK(text.find("cudaSomething: ") == 0);
        CHECK(text.find(cudaGetErrorName(row.error)) != std::string::npos);
        CHECK((text.find("nothing in this process") != std::string::npos) ==
              (row.status == DEFREC_ERROR_DEVICE_LOST));
    }
}

TEST_CASE("the device is lost exactly where nothing in the process can use it any more") {
    for (int code = 0; code <= cudaErrorApiFailureBase; ++code) {
        const auto error = static_cast<cudaError_t>(code);
        CHECK((cuda::status_of(error) == DEFREC_ERROR_DEVICE_LOST) == cuda::is_sticky(error));
        CHECK((cuda::status_of(error) == DEFREC_OK) == (error == cudaSuccess));
    }
}

TEST_CASE("an error that was reported is not reported by the next call again") {
    if (!under_test::available()) return;  // without a driver every call answers so
    void* memory = nullptr;
    const cudaError_t error = cudaMalloc(&memory, SIZE_MAX);
    CHECK(error == cudaErrorMemoryAllocation);
    CHECK(thrown_for(error));
    CHECK(cudaPeekAtLastError() == cudaSuccess);
}
