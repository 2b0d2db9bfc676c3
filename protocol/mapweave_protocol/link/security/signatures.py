"""Signatures under orders: whoever passes one on can neither make one up nor change it.

The key of a certificate of the team signs (ECDSA of FIPS 186-5, with SHA-256), and the certificate
goes along: who checks needs the team's authority only, and learns of no operator before.
"""

from collections.abc import Callable
from functools import lru_cache
from typing import TypeVar

import msgpack
from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.serialization import Encoding, load_pem_private_key
from cryptography.x509.oid import NameOID

from mapweave.errors import FileError
from mapweave_protocol.errors import MessageError
from mapweave_protocol.link.security.folder import AUTHORITY, CERTIFICATE, KEY, KeyFolder
from mapweave_protocol.link.security.roster import Member, Role
from mapweave_protocol.wire.coding.extensions import extended
from mapweave_protocol.wire.messages import OrderMessage
from mapweave_protocol.wire.orders.order_message import OrderSignature

ALGORITHM = ec.ECDSA(SHA256())
MOST_KNOWN = 64  # certificates: of operators, and what they are renewed by

T = TypeVar("T")


class Signer:
    """Signs orders in the name of a member.

    Parameters
    ----------
    keys
        The member's.

    Raises
    ------
    FileError
        If its certificate or key cannot be used.
    """

    def __init__(self, keys: KeyFolder) -> None:
        self._team = keys.member.team
        self._certificate = _certificate(keys, CERTIFICATE).public_bytes(Encoding.DER)
        path = keys.path / KEY
        key = _read(keys, KEY, lambda data: load_pem_private_key(data, None))
        if not isinstance(key, ec.EllipticCurvePrivateKey):
            raise FileError(path, "another kind of key than expected: mapweave keys makes P-256")
        self._key = key

    def signed(self, order: OrderMessage) -> OrderMessage:
        """Return `order` with our signature under it."""
        signature = self._key.sign(_content(self._team, order), ALGORITHM)
        seal = OrderSignature(certificate=self._certificate, signature=signature)
        return order.model_copy(update={"signature": seal})


class Verifier:
    """Checks whether orders are of whom they say.

    Parameters
    ----------
    keys
        Of whoever checks: with the team's authority among them.

    Raises
    ------
    FileError
        If the authority's certificate cannot be used.
    """

    def __init__(self, keys: KeyFolder) -> None:
        self._team = keys.member.team
        self._authority = _certificate(keys, AUTHORITY)
        self._trusted = lru_cache(MOST_KNOWN)(self._checked)

    def check(self, order: OrderMessage) -> None:
        """Check that the operator whom `order` names gave it, or the coordinator on its page.

        Raises
        ------
        MessageError
            If not: nobody signed it, or somebody else; or something in it was changed.
        """
        if order.signature is None:
            raise _refusal(order, "nobody signed it")
        certificate, key = self._trusted(order.signature.certificate)
        if not _is_in_time(certificate, order.time):
            raise _refusal(order, "given when the certificate under it was not valid")
        operator = Member(self._team, Role.OPERATOR, order.by)
        coordinator = Member(self._team, Role.COORDINATOR, Role.COORDINATOR.value)
        if _common_name(certificate) not in (operator.common_name, coordinator.common_name):
            raise _refusal(order, "signed by somebody else")
        try:
            key.verify(order.signature.signature, _content(self._team, order), ALGORITHM)
        except InvalidSignature as error:
            raise _refusal(order, "not what was signed") from error

    def _checked(self, data: bytes) -> tuple[x509.Certificate, ec.EllipticCurvePublicKey]:
        """Return a certificate of the team and its key; those of others raise `MessageError`."""
        try:
            certificate = x509.load_der_x509_certificate(data)
            certificate.verify_directly_issued_by(self._authority)
            key = certificate.public_key()
        except (ValueError, TypeError, InvalidSignature) as error:
            problem = "signed with a certificate that is not of this team"
            raise MessageError(OrderMessage.format, problem) from error
        if not isinstance(key, ec.EllipticCurvePublicKey):
            raise MessageError(OrderMessage.format, "signed with another kind of key")
        return certificate, key


def _content(team: str, order: OrderMessage) -> bytes:
    """Return what is signed: all that the order says, and to which team."""
    values = order.model_copy(update={"signature": None}).values()
    packed: bytes = msgpack.packb(extended((OrderMessage.format, team, values)))
    return packed


def _refusal(order: OrderMessage, why: str) -> MessageError:
    return MessageError(order.format, f"{order.id} of {order.by}: {why}")


def _is_in_time(certificate: x509.Certificate, time: float) -> bool:
    first, last = certificate.not_valid_before_utc, certificate.not_valid_after_utc
    return first.timestamp() <= time <= last.timestamp()


def _common_name(certificate: x509.Certificate) -> str | bytes | None:
    names = certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    return names[0].value if len(names) == 1 else None


def _certificate(keys: KeyFolder, name: str) -> x509.Certificate:
    return _read(keys, name, x509.load_pem_x509_certificate)


def _read(keys: KeyFolder, name: str, load: Callable[[bytes], T]) -> T:
    path = keys.path / name
    try:
        return load(path.read_bytes())
    except (OSError, ValueError, TypeError) as error:
        raise FileError(path, "cannot be used; expected what mapweave keys wrote") from error
