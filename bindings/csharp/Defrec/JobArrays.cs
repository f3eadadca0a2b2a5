using System;
using Defrec.Native;

namespace Defrec
{
    // The arrays of a result, copied into arrays of the caller. Nothing here allocates.
    public sealed unsafe partial class Job
    {
        /// <summary>
        /// Per control point: rectified camera from template frame. Returns how many elements were
        /// copied; destination may be longer.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// destination is null or too short; the error message says what is needed.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyMotions(Motion[] destination)
        {
            Check.NotNull(destination, nameof(destination));
            fixed (Motion* to = destination) return CopyMotions(to, destination.Length);
        }

        /// <summary>
        /// xyz per control point, now: rectified camera, mm. Returns how many elements were copied;
        /// destination may be longer.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// destination is null or too short; the error message says what is needed.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyNodePositions(float[] destination)
        {
            Check.NotNull(destination, nameof(destination));
            fixed (float* to = destination) return CopyNodePositions(to, destination.Length);
        }

        /// <summary>
        /// xyz per template vertex: rectified camera, mm. Returns how many elements were copied;
        /// destination may be longer.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// destination is null or too short; the error message says what is needed.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyVertices(float[] destination)
        {
            Check.NotNull(destination, nameof(destination));
            fixed (float* to = destination) return CopyVertices(to, destination.Length);
        }

        /// <summary>
        /// xyz per template vertex: unit length, towards the camera. Returns how many elements were
        /// copied; destination may be longer.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// destination is null or too short; the error message says what is needed.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyNormals(float[] destination)
        {
            Check.NotNull(destination, nameof(destination));
            fixed (float* to = destination) return CopyNormals(to, destination.Length);
        }

        /// <summary>
        /// How far to trust each template vertex. Returns how many elements were copied;
        /// destination may be longer.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// destination is null or too short; the error message says what is needed.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyVertexStatus(PointStatus[] destination)
        {
            Check.NotNull(destination, nameof(destination));
            fixed (PointStatus* to = destination) return CopyVertexStatus(to, destination.Length);
        }

        /// <summary>
        /// Root mean square of the 3D error to be expected of each template vertex, mm. Returns how
        /// many elements were copied; destination may be longer.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// destination is null or too short; the error message says what is needed.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyExpectedErrors(float[] destination)
        {
            Check.NotNull(destination, nameof(destination));
            fixed (float* to = destination) return CopyExpectedErrors(to, destination.Length);
        }

        /// <summary>
        /// xx, xy, xz, yy, yz, zz per template vertex: covariance of the position's error,
        /// rectified camera, mm^2. Returns how many elements were copied; destination may be
        /// longer.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// destination is null or too short; the error message says what is needed.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyVertexCovariance(float[] destination)
        {
            Check.NotNull(destination, nameof(destination));
            fixed (float* to = destination) return CopyVertexCovariance(to, destination.Length);
        }

        /// <summary>
        /// What was observed of each template vertex. Returns how many elements were copied;
        /// destination may be longer.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// destination is null or too short; the error message says what is needed.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyVertexEvidence(Evidence[] destination)
        {
            Check.NotNull(destination, nameof(destination));
            fixed (Evidence* to = destination) return CopyVertexEvidence(to, destination.Length);
        }

        /// <summary>
        /// The landmarks of the template. Returns how many elements were copied; destination may be
        /// longer.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// destination is null or too short; the error message says what is needed.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyLandmarks(Landmark[] destination)
        {
            Check.NotNull(destination, nameof(destination));
            fixed (Landmark* to = destination) return CopyLandmarks(to, destination.Length);
        }

        /// <summary>
        /// One per landmark; weight 0: outlier. Returns how many elements were copied; destination
        /// may be longer.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// destination is null or too short; the error message says what is needed.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyLandmarkMatches(Match[] destination)
        {
            Check.NotNull(destination, nameof(destination));
            fixed (Match* to = destination) return CopyLandmarkMatches(to, destination.Length);
        }

        /// <summary>
        /// One per patch of the template. Returns how many elements were copied; destination may be
        /// longer.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// destination is null or too short; the error message says what is needed.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyPatchObservations(PatchObservation[] destination)
        {
            Check.NotNull(destination, nameof(destination));
            fixed (PatchObservation* to = destination)
                return CopyPatchObservations(to, destination.Length);
        }

        /// <summary>
        /// One per piece of the surface. Returns how many elements were copied; destination may be
        /// longer.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// destination is null or too short; the error message says what is needed.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyPieces(Piece[] destination)
        {
            Check.NotNull(destination, nameof(destination));
            fixed (Piece* to = destination) return CopyPieces(to, destination.Length);
        }

        /// <summary>
        /// Of the rectified image, row by row, 1/16 px, <see cref="Constants.DisparityNone"/>
        /// without evidence; none unless <see cref="TrackerOptions.KeepDisparity"/>. Returns how
        /// many elements were copied; destination may be longer.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// destination is null or too short; the error message says what is needed.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyDisparity(short[] destination)
        {
            Check.NotNull(destination, nameof(destination));
            fixed (short* to = destination) return CopyDisparity(to, destination.Length);
        }

        // For arrays and spans alike; capacity in elements.
        private int CopyMotions(Motion* to, int capacity)
        {
            using (var use = new HandleUse(Handle))
            {
                defrec_result result = Read(use);
                return Copy(result.motions, result.node_count, sizeof(Motion), to, capacity);
            }
        }

        private int CopyNodePositions(float* to, int capacity)
        {
            using (var use = new HandleUse(Handle))
            {
                defrec_result result = Read(use);
                return Copy(
                    result.node_positions, 3 * result.node_count, sizeof(float), to, capacity);
            }
        }

        private int CopyVertices(float* to, int capacity)
        {
            using (var use = new HandleUse(Handle))
            {
                defrec_result result = Read(use);
                return Copy(result.vertices, 3 * result.vertex_count, sizeof(float), to, capacity);
            }
        }

        private int CopyNormals(float* to, int capacity)
        {
            using (var use = new HandleUse(Handle))
            {
                defrec_result result = Read(use);
                return Copy(result.normals, 3 * result.vertex_count, sizeof(float), to, capacity);
            }
        }

        private int CopyVertexStatus(PointStatus* to, int capacity)
        {
            using (var use = new HandleUse(Handle))
            {
                defrec_result result = Read(use);
                return Copy(
                    result.vertex_status, result.vertex_count, sizeof(PointStatus), to, capacity);
            }
        }

        private int CopyExpectedErrors(float* to, int capacity)
        {
            using (var use = new HandleUse(Handle))
            {
                defrec_result result = Read(use);
                return Copy(
                    result.expected_error_mm, result.vertex_count, sizeof(float), to, capacity);
            }
        }

        private int CopyVertexCovariance(float* to, int capacity)
        {
            using (var use = new HandleUse(Handle))
            {
                defrec_result result = Read(use);
                return Copy(
                    result.vertex_covariance, 6 * result.vertex_count, sizeof(float), to, capacity);
            }
        }

        private int CopyVertexEvidence(Evidence* to, int capacity)
        {
            using (var use = new HandleUse(Handle))
            {
                defrec_result result = Read(use);
                return Copy(
                    result.vertex_evidence, result.vertex_count, sizeof(Evidence), to, capacity);
            }
        }

        private int CopyLandmarks(Landmark* to, int capacity)
        {
            using (var use = new HandleUse(Handle))
            {
                defrec_result result = Read(use);
                return Copy(
                    result.landmarks, result.landmark_count, sizeof(Landmark), to, capacity);
            }
        }

        private int CopyLandmarkMatches(Match* to, int capacity)
        {
            using (var use = new HandleUse(Handle))
            {
                defrec_result result = Read(use);
                return Copy(
                    result.landmark_matches, result.landmark_count, sizeof(Match), to, capacity);
            }
        }

        private int CopyPatchObservations(PatchObservation* to, int capacity)
        {
            using (var use = new HandleUse(Handle))
            {
                defrec_result result = Read(use);
                return Copy(
                    result.patch_observations, result.patch_count, sizeof(PatchObservation), to,
                    capacity);
            }
        }

        private int CopyPieces(Piece* to, int capacity)
        {
            using (var use = new HandleUse(Handle))
            {
                defrec_result result = Read(use);
                return Copy(result.pieces, result.piece_count, sizeof(Piece), to, capacity);
            }
        }

        private int CopyDisparity(short* to, int capacity)
        {
            using (var use = new HandleUse(Handle))
            {
                defrec_result result = Read(use);
                return Copy(
                    result.disparity, result.disparity == null ? 0 : (ulong)pixels, sizeof(short),
                    to, capacity);
            }
        }

        private static int Copy(void* from, ulong count, int size, void* to, int capacity)
        {
            Check.Length(capacity, Check.ArrayLength(count, 1), "destination");
            NativeArray.Copy(from, to, (int)count, size);
            return (int)count;
        }
    }
}
