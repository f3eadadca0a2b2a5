// See check.hpp.
#include "backends/cuda/gpu/check.hpp"

namespace defrec::cuda {

// Most by CUDA's own word ("the process must be terminated and relaunched", driver_types.h), the
// others because what the process had is gone.
bool is_sticky(cudaError_t error) {
    switch (error) {
        case cudaErrorContained:
        case cudaErrorIllegalAddress:
        case cudaErrorLaunchTimeout:
        case cudaErrorAssert:
        case cudaErrorHardwareStackError:
        case cudaErrorIllegalInstruction:
        case cudaErrorMisalignedAddress:
        case cudaErrorInvalidAddressSpace:
        case cudaErrorInvalidPc:
        case cudaErrorLaunchFailure:
        case cudaErrorTensorMemoryLeak:
        case cudaErrorMpsClientTerminated:
        case cudaErrorExternalDevice:
        case cudaErrorECCUncorrectable:
        case cudaErrorNvlinkUncorrectable:
        case cudaErrorCudartUnloading:
        case cudaErrorDeviceUninitialized:
        case cudaErrorContextIsDestroyed:
        case cudaErrorMpsRpcFailure:
        case cudaErrorUnknown:
            return true;
        default:
            return false;
    }
}

defrec_status status_of(cudaError_t error) {
    if (error == cudaSuccess) return DEFREC_OK;
    if (is_sticky(error)) return DEFREC_ERROR_DEVICE_LOST;
    switch (error) {
        case cudaErrorMemoryAllocation:
            return DEFREC_ERROR_OUT_OF_MEMORY;
        // No driver, no GPU, or not for this process.
        case cudaErrorInsufficientDriver:
        case cudaErrorCallRequiresNewerDriver:
        case cudaErrorStubLibrary:
        case cudaErrorNoDevice:
        case cudaErrorDevicesUnavailable:
        case cudaErrorDeviceAlreadyInUse:
        case cudaErrorDeviceNotLicensed:
        case cudaErrorSystemNotReady:
        case cudaErrorSystemDriverMismatch:
        case cudaErrorCompatNotSupportedOnDevice:
        case cudaErrorMpsConnectionFailed:
        case cudaErrorMpsServerNotReady:
        case cudaErrorMpsMaxClientsReached:
        case cudaErrorMpsMaxConnectionsReached:
        // None of the machine code fits, and the driver cannot make any of the PTX.
        case cudaErrorInvalidKernelImage:
        case cudaErrorNoKernelImageForDevice:
        case cudaErrorInvalidPtx:
        case cudaErrorUnsupportedPtxVersion:
        case cudaErrorJitCompilerNotFound:
        case cudaErrorJitCompilationDisabled:
        // More than the GPU has.
        case cudaErrorLaunchOutOfResources:
        case cudaErrorCooperativeLaunchTooLarge:
        case cudaErrorNotSupported:
            return DEFREC_ERROR_UNSUPPORTED;
        default:
            return DEFREC_ERROR_INTERNAL;
    }
}

void check(cudaError_t error, const char* call) {
    if (error == cudaSuccess) return;
    cudaGetLastError();  // one that is not sticky must not be reported again by the next call
    std::string text =
        std::string(call) + ": " + cudaGetErrorString(error) + " (" + cudaGetErrorName(error) + ")";
    if (is_sticky(error)) text += "; nothing in this process can use the GPU any more";
    throw StageError(status_of(error), text);
}

}  // namespace defrec::cuda
