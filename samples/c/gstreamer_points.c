/* Follows pixels of the first left image through the images of a GStreamer pipeline.
 *   gstreamer_points FX,FY,CX,CY,BASELINE_MM POINTS.csv OUT.csv PIPELINE [DEVICE_ID]
 * PIPELINE is as gst-launch-1.0 takes it, and ends in an appsink named both, whose images hold the
 * left view beside the right one, or in two, named left and right:
 *   "v4l2src device=/dev/video0 ! videoconvert ! appsink name=left
 *    v4l2src device=/dev/video2 ! videoconvert ! appsink name=right"
 * The newest images of cameras are taken, and all of files. OUT.csv is as of track_folder. */
#include <gst/app/gstappsink.h>
#include <gst/gst.h>
#include <gst/video/video.h>

#include "points.h"

typedef struct {
    GstElement* pipeline;
    GstBus* bus;
    GstAppSink* left;  /* or of both views */
    GstAppSink* right; /* NULL: side by side in the left one's images */
} stereo_pipeline;

/* ---- the pipeline ---- */

static GstAppSink* find_sink(const stereo_pipeline* source, const char* name) {
    GstElement* element = gst_bin_get_by_name(GST_BIN(source->pipeline), name);
    GstCaps* caps;
    if (element == NULL) return NULL;
    if (!GST_IS_APP_SINK(element)) fail("the element %s is no appsink", name);
    caps = gst_caps_from_string("video/x-raw,format=BGR");
    gst_app_sink_set_caps(GST_APP_SINK(element), caps);
    gst_caps_unref(caps);
    return GST_APP_SINK(element);
}

static void set_newest_only(GstAppSink* sink) {
    gst_app_sink_set_max_buffers(sink, 1);
    gst_app_sink_set_drop(sink, TRUE);
}

static stereo_pipeline open_pipeline(const char* text) {
    stereo_pipeline source;
    GError* error = NULL;
    source.pipeline = gst_parse_launch(text, &error);
    if (error != NULL) fail("GStreamer does not accept the pipeline: %s", error->message);
    if (!GST_IS_PIPELINE(source.pipeline)) fail("the pipeline is an element alone");
    source.bus = gst_element_get_bus(source.pipeline);
    source.left = find_sink(&source, "both");
    source.right = NULL;
    if (source.left == NULL) {
        source.left = find_sink(&source, "left");
        source.right = find_sink(&source, "right");
        if (source.left == NULL || source.right == NULL)
            fail("the pipeline has no appsink named both, and not two named left and right");
    }
    /* Cameras give no image before they play: what comes later than it is wanted is dropped. */
    if (gst_element_set_state(source.pipeline, GST_STATE_PAUSED) == GST_STATE_CHANGE_NO_PREROLL) {
        set_newest_only(source.left);
        if (source.right != NULL) set_newest_only(source.right);
    }
    gst_element_set_state(source.pipeline, GST_STATE_PLAYING);
    return source;
}

static void close_pipeline(stereo_pipeline* source) {
    gst_element_set_state(source->pipeline, GST_STATE_NULL);
    gst_object_unref(source->left);
    if (source->right != NULL) gst_object_unref(source->right);
    gst_object_unref(source->bus);
    gst_object_unref(source->pipeline);
}

/* Waits for the next image; NULL at the end. */
static GstSample* pull(const stereo_pipeline* source, GstAppSink* sink) {
    for (;;) {
        GstSample* sample = gst_app_sink_try_pull_sample(sink, 100 * GST_MSECOND);
        GstMessage* message;
        if (sample != NULL) return sample;
        message = gst_bus_pop_filtered(source->bus, GST_MESSAGE_ERROR);
        if (message != NULL) {
            GError* error = NULL;
            gst_message_parse_error(message, &error, NULL);
            fail("the pipeline stopped: %s", error->message);
        }
        if (gst_app_sink_is_eos(sink)) return NULL;
    }
}

static int64_t time_of(GstSample* sample) {
    const GstBuffer* buffer = gst_sample_get_buffer(sample);
    if (!GST_BUFFER_PTS_IS_VALID(buffer))
        fail("the images have no times; many sources give them with do-timestamp=true");
    return (int64_t)GST_BUFFER_PTS(buffer);
}

/* ---- an image pair ---- */

typedef struct {
    GstSample* samples[2]; /* the second is NULL where one image holds both views */
    GstVideoFrame frames[2];
    defrec_image left, right; /* show the pixels of the frames */
} stereo_images;

static void drop(GstSample** sample) {
    gst_sample_unref(*sample);
    *sample = NULL;
}

/* The next images of one time; 0 at the end. */
static int pull_pair(const stereo_pipeline* source, GstSample* samples[2]) {
    const int64_t tolerance_ns = 1000000000 / 60; /* half a frame, at 30 frames a second */
    samples[0] = samples[1] = NULL;
    for (;;) {
        int64_t late;
        if (samples[0] == NULL) samples[0] = pull(source, source->left);
        if (samples[0] != NULL && source->right == NULL) return 1;
        if (samples[0] != NULL && samples[1] == NULL) samples[1] = pull(source, source->right);
        if (samples[0] == NULL || samples[1] == NULL) break;
        late = time_of(samples[1]) - time_of(samples[0]);
        if (late <= tolerance_ns && late >= -tolerance_ns) return 1;
        drop(&samples[late > 0 ? 0 : 1]);
    }
    if (samples[0] != NULL) drop(&samples[0]);
    if (samples[1] != NULL) drop(&samples[1]);
    return 0;
}

static defrec_image map_view(GstSample* sample, GstVideoFrame* frame) {
    GstVideoInfo info;
    defrec_image view;
    if (!gst_video_info_from_caps(&info, gst_sample_get_caps(sample)) ||
        !gst_video_frame_map(frame, &info, gst_sample_get_buffer(sample), GST_MAP_READ))
        fail("an image cannot be read");
    DEFREC_INIT(&view);
    view.format = DEFREC_FORMAT_BGR8;
    view.width = (uint32_t)GST_VIDEO_FRAME_WIDTH(frame);
    view.height = (uint32_t)GST_VIDEO_FRAME_HEIGHT(frame);
    view.stride = (uint64_t)GST_VIDEO_FRAME_PLANE_STRIDE(frame, 0);
    view.pixels = GST_VIDEO_FRAME_PLANE_DATA(frame, 0);
    return view;
}

/* 0 at the end. */
static int next_images(const stereo_pipeline* source, stereo_images* images) {
    if (!pull_pair(source, images->samples)) return 0;
    images->left = map_view(images->samples[0], &images->frames[0]);
    if (images->samples[1] != NULL) {
        images->right = map_view(images->samples[1], &images->frames[1]);
        return 1;
    }
    if (images->left.width % 2 != 0) fail("the images cannot be cut into two halves");
    images->left.width /= 2;
    images->right = images->left;
    images->right.pixels = (const uint8_t*)images->left.pixels + (size_t)3 * images->left.width;
    return 1;
}

static void release_images(stereo_images* images) {
    int i;
    for (i = 0; i < 2 && images->samples[i] != NULL; ++i) {
        gst_video_frame_unmap(&images->frames[i]);
        drop(&images->samples[i]);
    }
}

/* ---- the loop ---- */

static size_t track_all(const stereo_pipeline* source, const char* camera, const char* device_id,
                        followed_points* points, FILE* out) {
    stereo_images images;
    tracking running;
    size_t frame;
    memset(&running, 0, sizeof running);
    for (frame = 0; next_images(source, &images); ++frame) {
        const int64_t timestamp_ns = time_of(images.samples[0]);
        defrec_job job;
        defrec_result result;
        if (frame == 0) {
            const image size = {images.left.width, images.left.height, NULL};
            running = open_tracking(camera, &size, device_id, 0);
        }
        check(submit_views(&running, &images.left, &images.right, timestamp_ns, &job),
              "submitting a frame");
        release_images(&images); /* the tracker has copied the pixels */
        check(defrec_job_wait(job, UINT64_MAX), "tracking a frame");
        DEFREC_INIT(&result);
        check(defrec_job_result(job, &result), "reading the result");
        follow(points, &running, job, &result);
        write_points(out, frame, points);
        printf("frame %zu at %.3f s: %s\n", frame, (double)timestamp_ns * 1e-9,
               points->is_known ? "points followed" : "points lost");
        defrec_job_release(job);
    }
    if (frame > 0) close_tracking(&running);
    return frame;
}

int main(int argc, char** argv) {
    stereo_pipeline source;
    followed_points points;
    size_t frames;
    FILE* out;
    if (argc < 5 || argc > 6) {
        fprintf(stderr,
                "usage: gstreamer_points FX,FY,CX,CY,BASELINE_MM POINTS.csv OUT.csv PIPELINE "
                "[DEVICE_ID]\n");
        return 2;
    }
    gst_init(NULL, NULL);
    points = read_points(argv[2]);
    source = open_pipeline(argv[4]);
    out = fopen(argv[3], "w");
    if (out == NULL) fail("%s: cannot be written", argv[3]);
    write_header(out);
    frames = track_all(&source, argv[1], argc == 6 ? argv[5] : NULL, &points, out);
    if (fclose(out) != 0) fail("%s: could not be written to its end", argv[3]);
    if (frames == 0) fail("the pipeline ended without an image");
    close_pipeline(&source);
    free_points(&points);
    return 0;
}
