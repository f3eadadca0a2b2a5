using System;
using Defrec.Native;

namespace Defrec
{
    // The arrays of a result, copied into arrays of the caller. Nothing here allocates.
    public sealed unsafe partial class Job
    {
        /// <summary>Per control point: rectified camera from template frame. Returns how many elements were copied; destination may be longer.</summary>
        /// <exception cref="ArgumentException">destination is null or too short; the sentence says what is needed.</exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyMotions(Motion[] destination)
        {
            Check.NotNull(destination, nameof(destination));
            using (var use = new HandleUse(Handle))
            fixed (Motion* to = destination)
            {
                defrec_result result = Read(use);
                return Copy(result.motions, result.node_count, sizeof(Motion), to, destination.Length);
            }
        }

        /// <summary>xyz per control point, now: rectified camera, mm. Returns how many elements were copied; destination may be longer.</summary>
        /// <exception cref="ArgumentException">destination is null or too short; the sentence says what is needed.</exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyNodePositions(float[] destination)
        {
            Check.NotNull(destination, nameof(destination));
            using (var use = new HandleUse(Handle))
            fixed (float* to = destination)
            {
                defrec_result result = Read(use);
                return Copy(result.node_positions, 3 * result.node_count, sizeof(float), to, destination.Length);
            }
        }

        /// <summary>xyz per template vertex: rectified camera, mm. Returns how many elements were copied; destination may be longer.</summary>
        /// <exception cref="ArgumentException">destination is null or too short; the sentence says what is needed.</exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyVertices(float[] destination)
        {
            Check.NotNull(destination, nameof(destination));
            using (var use = new HandleUse(Handle))
            fixed (float* to = destination)
            {
                defrec_result result = Read(use);
                return Copy(result.vertices, 3 * result.vertex_count, sizeof(float), to, destination.Length);
            }
        }

        /// <summary>xyz per template vertex: unit length, towards the camera. Returns how many elements were copied; destination may be longer.</summary>
        /// <exception cref="ArgumentException">destination is null or too short; the sentence says what is needed.</exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyNormals(float[] destination)
        {
            Check.NotNull(destination, nameof(destination));
            using (var use = new HandleUse(Handle))
            fixed (float* to = destination)
            {
                defrec_result result = Read(use);
                return Copy(result.normals, 3 * result.vertex_count, sizeof(float), to, destination.Length);
            }
        }

        /// <summary>What to believe of each template vertex. Returns how many elements were copied; destination may be longer.</summary>
        /// <exception cref="ArgumentException">destination is null or too short; the sentence says what is needed.</exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyVertexStatus(PointStatus[] destination)
        {
            Check.NotNull(destination, nameof(destination));
            using (var use = new HandleUse(Handle))
            fixed (PointStatus* to = destination)
            {
                defrec_result result = Read(use);
                return Copy(result.vertex_status, result.vertex_count, sizeof(PointStatus), to, destination.Length);
            }
        }

        /// <summary>One standard deviation of each template vertex, mm. Returns how many elements were copied; destination may be longer.</summary>
        /// <exception cref="ArgumentException">destination is null or too short; the sentence says what is needed.</exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyExpectedErrors(float[] destination)
        {
            Check.NotNull(destination, nameof(destination));
            using (var use = new HandleUse(Handle))
            fixed (float* to = destination)
            {
                defrec_result result = Read(use);
                return Copy(result.expected_error_mm, result.vertex_count, sizeof(float), to, destination.Length);
            }
        }

        /// <summary>The landmarks of the template. Returns how many elements were copied; destination may be longer.</summary>
        /// <exception cref="ArgumentException">destination is null or too short; the sentence says what is needed.</exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyLandmarks(Landmark[] destination)
        {
            Check.NotNull(destination, nameof(destination));
            using (var use = new HandleUse(Handle))
            fixed (Landmark* to = destination)
            {
                defrec_result result = Read(use);
                return Copy(result.landmarks, result.landmark_count, sizeof(Landmark), to, destination.Length);
            }
        }

        /// <summary>One per landmark; weight 0: outlier. Returns how many elements were copied; destination may be longer.</summary>
        /// <exception cref="ArgumentException">destination is null or too short; the sentence says what is needed.</exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyLandmarkMatches(Match[] destination)
        {
            Check.NotNull(destination, nameof(destination));
            using (var use = new HandleUse(Handle))
            fixed (Match* to = destination)
            {
                defrec_result result = Read(use);
                return Copy(result.landmark_matches, result.landmark_count, sizeof(Match), to, destination.Length);
            }
        }

        /// <summary>One per patch of the template. Returns how many elements were copied; destination may be longer.</summary>
        /// <exception cref="ArgumentException">destination is null or too short; the sentence says what is needed.</exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyPatchObservations(PatchObservation[] destination)
        {
            Check.NotNull(destination, nameof(destination));
            using (var use = new HandleUse(Handle))
            fixed (PatchObservation* to = destination)
            {
                defrec_result result = Read(use);
                return Copy(result.patch_observations, result.patch_count, sizeof(PatchObservation), to, destination.Length);
            }
        }

        /// <summary>Of the rectified image, row by row, 1/16 px, <see cref="Constants.DisparityNone"/> without evidence; none unless <see cref="TrackerOptions.KeepDisparity"/>. Returns how many elements were copied; destination may be longer.</summary>
        /// <exception cref="ArgumentException">destination is null or too short; the sentence says what is needed.</exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyDisparity(short[] destination)
        {
            Check.NotNull(destination, nameof(destination));
            using (var use = new HandleUse(Handle))
            fixed (short* to = destination)
            {
                defrec_result result = Read(use);
                return Copy(result.disparity, result.disparity == null ? 0 : (ulong)pixels, sizeof(short), to, destination.Length);
            }
        }

        private static int Copy(void* from, ulong count, int size, void* to, int capacity)
        {
            Check.Length(capacity, Check.ArrayLength(count, 1), "destination");
            if (count > 0) Buffer.MemoryCopy(from, to, (long)capacity * size, (long)count * size);
            return (int)count;
        }
    }
}
