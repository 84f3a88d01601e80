"""What may go wrong: exceptions whose text is the coordinator's or the program's sentence."""


class Error(Exception):
    """Of all others, and of what has no class of its own."""


class UsageError(Error, ValueError):
    """A setting, an argument or a scene that makes no sense."""


class NotFoundError(Error, LookupError):
    """There is no such job."""


class StateError(Error):
    """The job does not allow this in the state that it is in."""


class JobFailedError(Error):
    """The job was cancelled or failed."""


class AccessError(Error):
    """The token is unknown or missing, or may not do this."""


class UnreachableError(Error, ConnectionError):
    """The coordinator does not answer."""


# Joiners are needed by scripts and emoji.
_SHOWN = "\u200c\u200d\u00a0"


def printable(text: str, keeps: str = "") -> str:
    """`text` as a terminal may show it: whatever comes from another process could hold bytes that
    move its cursor. Control and invisible characters but those of `keeps` are written out."""
    def shown(character: str) -> str:
        if character.isprintable() or character in _SHOWN or character in keeps:
            return character
        code = ord(character)
        return f"\\x{code:02x}" if code < 0x80 else f"\\u{{{code:x}}}"
    return "".join(map(shown, text))
