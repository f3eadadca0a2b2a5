using System;
using System.Text;

namespace Defrec.Native
{
    /// <summary>Strings of the C API: UTF-8 that ends with a zero byte.</summary>
    internal static unsafe class Utf8
    {
        private static readonly UTF8Encoding Strict = new UTF8Encoding(false, true);

        /// <summary>
        /// With the zero byte; null for null. A zero inside, which would cut the text, and half a
        /// character are argument errors.
        /// </summary>
        internal static byte[] Bytes(string text, string name)
        {
            if (text == null) return null;
            if (text.IndexOf('\0') >= 0)
                throw new ArgumentException("The text has a zero character inside.", name);
            try
            {
                var bytes = new byte[Strict.GetByteCount(text) + 1];
                Strict.GetBytes(text, 0, text.Length, bytes, 0);
                return bytes;
            }
            catch (EncoderFallbackException e)
            {
                throw new ArgumentException("The text is not valid Unicode.", name, e);
            }
        }

        /// <summary>"" for NULL.</summary>
        internal static string Read(byte* text)
        {
            return text == null ? "" : Encoding.UTF8.GetString(text, Length(text));
        }

        /// <summary>Likewise; makes nothing where it is ASCII and what was read before.</summary>
        internal static string Read(byte* text, string before)
        {
            return IsAscii(text, before) ? before : Read(text);
        }

        private static bool IsAscii(byte* text, string expected)
        {
            if (text == null || expected == null) return false;
            for (int i = 0; i < expected.Length; ++i)
                if (text[i] != expected[i] || text[i] == 0 || text[i] >= 0x80) return false;
            return text[expected.Length] == 0;
        }

        private static int Length(byte* text)
        {
            int length = 0;
            while (text[length] != 0) ++length;
            return length;
        }
    }
}
