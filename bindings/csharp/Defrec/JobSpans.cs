#if NETSTANDARD2_1
using System;
using System.Runtime.InteropServices;
using Defrec.Native;

namespace Defrec
{
    // What Job has for arrays, for spans.
    public sealed unsafe partial class Job
    {
        /// <summary>
        /// Like the overload for arrays; an empty status or expectedErrorMm is not wanted.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// A span is too short, or templateXyz not a multiple of 3 long.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">
        /// The job is not done, failed, or its tracker has no template.
        /// </exception>
        public void WarpPoints(
            ReadOnlySpan<double> templateXyz, Span<double> xyz, Span<PointStatus> status,
            Span<double> expectedErrorMm)
        {
            int count = Check.Groups(templateXyz.Length, 3, nameof(templateXyz));
            Check.Length(xyz.Length, templateXyz.Length, nameof(xyz));
            if (!status.IsEmpty) Check.Length(status.Length, count, nameof(status));
            if (!expectedErrorMm.IsEmpty)
                Check.Length(expectedErrorMm.Length, count, nameof(expectedErrorMm));
            fixed (
                double* from = &MemoryMarshal.GetReference(templateXyz),
                to = &MemoryMarshal.GetReference(xyz))
            fixed (PointStatus* statuses = &MemoryMarshal.GetReference(status))
            fixed (double* error = &MemoryMarshal.GetReference(expectedErrorMm))
                Warp(
                    from, count, to, status.IsEmpty ? null : statuses,
                    expectedErrorMm.IsEmpty ? null : error);
        }

        /// <summary>Like the overload for arrays.</summary>
        /// <exception cref="ArgumentException">
        /// A span is too short, or templateXyz not a multiple of 3 long.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">
        /// The job is not done, failed, or its tracker has no template.
        /// </exception>
        public void GetPointCovariances(
            ReadOnlySpan<double> templateXyz, Span<double> covariance, Span<Evidence> evidence)
        {
            int count = Check.Groups(templateXyz.Length, 3, nameof(templateXyz));
            Check.Length(covariance.Length, 6L * count, nameof(covariance));
            if (!evidence.IsEmpty) Check.Length(evidence.Length, count, nameof(evidence));
            fixed (
                double* from = &MemoryMarshal.GetReference(templateXyz),
                to = &MemoryMarshal.GetReference(covariance))
            fixed (Evidence* observed = &MemoryMarshal.GetReference(evidence))
                GetCovariances(from, count, to, evidence.IsEmpty ? null : observed);
        }

        /// <summary>
        /// Like the overload for arrays; an empty status, expectedErrorMm or covariance is not
        /// wanted.
        /// </summary>
        /// <exception cref="ArgumentException">targets is null, or a span is too short.</exception>
        /// <exception cref="ObjectDisposedException">
        /// The job was disposed, or the targets were.
        /// </exception>
        /// <exception cref="DefrecException">As of the overload for arrays.</exception>
        public void MoveTargets(
            Targets targets, Span<double> xyz, Span<PointStatus> status,
            Span<double> expectedErrorMm, Span<double> covariance)
        {
            Check.NotNull(targets, nameof(targets));
            int count = targets.Count;
            Check.Length(xyz.Length, 3L * count, nameof(xyz));
            if (!status.IsEmpty) Check.Length(status.Length, count, nameof(status));
            if (!expectedErrorMm.IsEmpty)
                Check.Length(expectedErrorMm.Length, count, nameof(expectedErrorMm));
            if (!covariance.IsEmpty)
                Check.Length(covariance.Length, 6L * count, nameof(covariance));
            fixed (double* to = &MemoryMarshal.GetReference(xyz))
            fixed (PointStatus* statuses = &MemoryMarshal.GetReference(status))
            fixed (double* error = &MemoryMarshal.GetReference(expectedErrorMm),
                   errors = &MemoryMarshal.GetReference(covariance))
                Move(
                    targets, to, status.IsEmpty ? null : statuses,
                    expectedErrorMm.IsEmpty ? null : error, covariance.IsEmpty ? null : errors);
        }
    }
}
#endif
