"""The certificate authority of a team: makes itself, and certificates of members."""

import ipaddress
import os
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Self

from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import (
    Encoding,
    NoEncryption,
    PrivateFormat,
    load_pem_private_key,
)
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from mapweave.errors import FileError
from mapweave_protocol.link.security.folder import AUTHORITY, CERTIFICATE, KEY
from mapweave_protocol.link.security.roster import Member

AUTHORITY_KEY = "ca.key"
# The authority outlives those it signs: their certificates are renewed, and it is not.
AUTHORITY_DAYS = 3650
EARLY = timedelta(days=1)  # clocks of robots go wrong: valid from before it is made
PURPOSES = (ExtendedKeyUsageOID.CLIENT_AUTH, ExtendedKeyUsageOID.SERVER_AUTH)


@dataclass(frozen=True, slots=True)
class Authority:
    """What a team's certificates are signed by.

    Attributes
    ----------
    certificate, key
        Of its own; the key should not leave the machine where it was made.
    """

    certificate: x509.Certificate
    key: ec.EllipticCurvePrivateKey

    @classmethod
    def make(cls, team: str, now: datetime, days: int) -> Self:
        """Return a new one, valid for so many days, and for ten years at least."""
        key = ec.generate_private_key(ec.SECP256R1())
        name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, f"mapweave {team}")])
        end = _after(now, max(days, AUTHORITY_DAYS))
        builder = _builder(name, name, key.public_key(), now, end)
        usage = _usage(signs_certificates=True)
        certificate = (
            builder.add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
            .add_extension(usage, critical=True)
            .add_extension(_name_of(key.public_key()), critical=False)
            .sign(key, hashes.SHA256())
        )
        return cls(certificate, key)

    @classmethod
    def read(cls, folder: Path) -> Self:
        """Read one that `write` wrote.

        Raises
        ------
        FileError
            If it is damaged.
        """
        try:
            certificate = x509.load_pem_x509_certificate((folder / AUTHORITY).read_bytes())
            key = load_pem_private_key((folder / AUTHORITY_KEY).read_bytes(), None)
        except (OSError, ValueError, TypeError) as error:
            raise FileError(folder, "no authority that mapweave keys made") from error
        if not isinstance(key, ec.EllipticCurvePrivateKey):
            raise FileError(folder / AUTHORITY_KEY, "another kind of key than expected")
        return cls(certificate, key)

    def write(self, folder: Path) -> None:
        """Write both into `folder`."""
        (folder / AUTHORITY).write_bytes(self.certificate.public_bytes(Encoding.PEM))
        write_key(folder / AUTHORITY_KEY, self.key)

    def issue(
        self, member: Member, folder: Path, now: datetime, days: int, hosts: Sequence[str] = ()
    ) -> None:
        """Write a certificate of `member`, its key and our own certificate into `folder`.

        Parameters
        ----------
        days
            How long it is valid, as far as we are ourselves.
        hosts
            Names and addresses under which it is reached: with any, it is a server's certificate.
        """
        key = ec.generate_private_key(ec.SECP256R1())
        subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, member.common_name)])
        end = min(_after(now, days), self.certificate.not_valid_after_utc)
        builder = _builder(self.certificate.subject, subject, key.public_key(), now, end)
        purposes = PURPOSES if hosts else PURPOSES[:1]
        signer = x509.AuthorityKeyIdentifier.from_issuer_public_key(self.key.public_key())
        builder = (
            builder.add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
            .add_extension(_usage(signs_certificates=False), critical=True)
            .add_extension(x509.ExtendedKeyUsage(purposes), critical=False)
            .add_extension(_names(member, hosts), critical=False)
            .add_extension(_name_of(key.public_key()), critical=False)
            .add_extension(signer, critical=False)  # Python 3.13 asks for both
        )
        certificate = builder.sign(self.key, hashes.SHA256())
        (folder / CERTIFICATE).write_bytes(certificate.public_bytes(Encoding.PEM))
        (folder / AUTHORITY).write_bytes(self.certificate.public_bytes(Encoding.PEM))
        write_key(folder / KEY, key)


def write_key(path: Path, key: ec.EllipticCurvePrivateKey) -> None:
    """Write a key that its owner alone may read, from the first byte on."""
    path.unlink(missing_ok=True)
    file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    with os.fdopen(file, "wb") as out:
        out.write(key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption()))


def _builder(
    issuer: x509.Name,
    subject: x509.Name,
    key: ec.EllipticCurvePublicKey,
    now: datetime,
    end: datetime,
) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .issuer_name(issuer)
        .subject_name(subject)
        .public_key(key)
        .serial_number(x509.random_serial_number())
        .not_valid_before(now.astimezone(UTC) - EARLY)
        .not_valid_after(end)
    )


def _after(now: datetime, days: int) -> datetime:
    return now.astimezone(UTC) + timedelta(days=days)


def _name_of(key: ec.EllipticCurvePublicKey) -> x509.SubjectKeyIdentifier:
    return x509.SubjectKeyIdentifier.from_public_key(key)


def _usage(*, signs_certificates: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=True,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        key_cert_sign=signs_certificates,
        crl_sign=signs_certificates,
        encipher_only=False,
        decipher_only=False,
    )


def _names(member: Member, hosts: Sequence[str]) -> x509.SubjectAlternativeName:
    return x509.SubjectAlternativeName([_name(host) for host in hosts or (member.common_name,)])


def _name(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(host))
    except ValueError:
        return x509.DNSName(host)
