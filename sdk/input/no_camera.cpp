// Cameras in a build without GStreamer: an error message.
#include "sdk/input/camera_name.hpp"
#include "sdk/input/camera_source.hpp"
#include "sdk/io/exit_code.hpp"

namespace defrec::cli {

struct CameraSource::Impl {
    std::string fault;
};

CameraSource::CameraSource(const CameraOptions& options) {
    throw CliError(ExitCode::kInput, shown_source(options.cameras.front()) +
                                         ": this program was built without GStreamer, which "
                                         "cameras need; give recorded images or videos.");
}

CameraSource::~CameraSource() = default;

bool CameraSource::read(CameraPair&) { return false; }

const std::string& CameraSource::fault() const { return impl_->fault; }

double CameraSource::fps() const { return 0; }

CameraCounts CameraSource::counts() const { return {}; }

void CameraSource::set_notice_handler(std::function<void(const std::string&)>) {}

}  // namespace defrec::cli
