using System;
using Defrec.Native;

namespace Defrec
{
    /// <summary>The native library in use. Any thread.</summary>
    public static unsafe class DefrecLibrary
    {
        /// <summary>Version of the C API that the library offers: major * 1000 + minor.</summary>
        /// <exception cref="DllNotFoundException">
        /// There is no library; the error message says where it is looked for.
        /// </exception>
        public static int ApiVersion
        {
            get
            {
                try
                {
                    return (int)NativeMethods.defrec_version();
                }
                catch (DllNotFoundException e)
                {
                    throw new DllNotFoundException(
                        NativeMethods.Library +
                            " was not found, or a library that it needs. It is looked for beside " +
                            "Defrec.dll, in the folders of LD_LIBRARY_PATH and in those of the " +
                            "system.",
                        e);
                }
            }
        }

        /// <summary>The library's release, for people: "0.1.0".</summary>
        /// <exception cref="DllNotFoundException">There is no library.</exception>
        /// <exception cref="DefrecException">
        /// The library is of another version than this assembly needs.
        /// </exception>
        public static string Release
        {
            get
            {
                RequireVersion();
                return Utf8.Read(NativeMethods.defrec_version_string());
            }
        }

        /// <summary>
        /// The name of a status in the C API, "DEFREC_ERROR_ARGUMENT"; "unknown status" for others.
        /// </summary>
        /// <exception cref="DllNotFoundException">There is no library.</exception>
        /// <exception cref="DefrecException">
        /// The library is of another version than this assembly needs.
        /// </exception>
        public static string NameOf(Status status)
        {
            RequireVersion();
            return Utf8.Read(NativeMethods.defrec_status_name(status));
        }

        /// <summary>Before the first handle of each context, on which all others stand.</summary>
        internal static void RequireVersion()
        {
            int version = ApiVersion;
            if (version / 1000 == Constants.ApiMajor && version % 1000 >= Constants.ApiMinor)
                return;
            throw new DefrecException(
                Status.ErrorVersion,
                NativeMethods.Library + " offers version " + version / 1000 + "." + version % 1000 +
                    " of the C API; this Defrec.dll needs " + Constants.ApiMajor + "." +
                    Constants.ApiMinor + " or a later " + Constants.ApiMajor + ".x.");
        }
    }
}
